/* SPDX-License-Identifier: MIT */
/* Implements core/coefficients.h (see there): makes the coefficient records of a program. Used by firmware/app,
 * firmware/core and host tools: app/program_table, core/coefficient_cache and host tools make the records, interpolator
 * and program clock read them. Any context, if not stated otherwise. Writes only to the memory or the sink that it is
 * given; no I/O. */
#include "core/coefficients.h"

#include <string.h>

#include "core/ph_segment.h"
#include "core/qmath.h"

static uint64_t pieces_size(const struct program *p, const struct kernel *kernel)
{
    return (uint64_t)p->header.piece_count * coefficients_piece_size(kernel);
}

uint64_t coefficients_size(const struct program *p, const struct kernel *kernel)
{
    return pieces_size(p, kernel) + (uint64_t)p->header.segment_count *
                                        coefficients_segment_size(kernel, p->header.axis_count);
}

/* Bounds of the windows, and their ends: of that with the last piece none. */
static void look_ahead(struct coefficients_piece *out, const struct program *p, uint32_t i)
{
    uint64_t end_q32_s = qmath_q32_of_q42(out->start_q42_s);
    uint32_t after = i;
    for (uint32_t k = 0; k < OVERRIDE_WINDOWS; k++) {
        const uint32_t pieces = override_window_pieces(k);
        override_bounds_of(&out->ahead[k], p, i, pieces);
        for (; after - i < pieces && after < p->header.piece_count; after++) {
            end_q32_s += program_piece_duration(p, after);
        }
        out->ahead_end_q32_s[k] = after < p->header.piece_count ? end_q32_s : UINT64_MAX;
    }
}

void coefficients_make_piece(struct coefficients_piece *out, const struct program *p,
                             const struct kernel *kernel, uint32_t i, uint64_t start_q42_s)
{
    struct program_piece piece;
    program_piece_get(p, i, &piece);
    out->start_q42_s = start_q42_s;
    out->end_q42_s = i + 1u == p->header.piece_count
                         ? qmath_q42_of_q32(p->header.duration_q32_s)
                         : start_q42_s + qmath_q42_of_q32(piece.duration_q32_s);
    out->next = 0;
    out->number = i;
    look_ahead(out, p, i);
    kernel->piece_set(&out->feed, &piece);
}

void coefficients_make_segment(struct coefficients_segment *out, const struct program *p,
                               const struct kernel *kernel, uint32_t i)
{
    struct program_segment segment;
    struct ph_segment ph;
    program_segment_get(p, i, &segment);
    ph_segment_expand(&ph, &segment);
    out->from_q40_mm = i == 0 ? INT64_MIN : segment.start_q40_mm;
    out->to_q40_mm =
        i + 1u == p->header.segment_count ? INT64_MAX : program_segment_start(p, i + 1u);
    out->next = 0;
    out->back = 0;
    out->number = i;
    kernel_path(kernel, ph.axis_count)->segment_set(&out->path, &ph);
}

int coefficients_make(const struct program *p, const struct kernel *kernel, coefficients_sink *sink,
                      void *context)
{
    union {
        struct coefficients_piece piece;
        struct coefficients_segment segment;
        uint8_t bytes[sizeof(struct coefficients_segment)];
    } record;
    const uint32_t piece_size = coefficients_piece_size(kernel);
    const uint32_t segment_size = coefficients_segment_size(kernel, p->header.axis_count);
    uint64_t start_q42_s = 0;
    int error = 0;
    memset(&record, 0, sizeof record);
    for (uint32_t i = 0; error == 0 && i < p->header.piece_count; i++) {
        coefficients_make_piece(&record.piece, p, kernel, i, start_q42_s);
        start_q42_s = record.piece.end_q42_s;
        record.piece.next = i + 1u < p->header.piece_count ? (int32_t)piece_size : 0;
        error = sink(context, record.bytes, piece_size);
    }
    memset(&record, 0, sizeof record);
    for (uint32_t i = 0; error == 0 && i < p->header.segment_count; i++) {
        coefficients_make_segment(&record.segment, p, kernel, i);
        record.segment.next = (int16_t)(i + 1u < p->header.segment_count ? segment_size : 0u);
        record.segment.back = (int16_t)(i > 0u ? -(int32_t)segment_size : 0);
        error = sink(context, record.bytes, segment_size);
    }
    return error;
}

void coefficients_window_of(struct coefficients_window *out, const struct program *p)
{
    const struct kernel *kernel = p->coefficients_for;
    out->kernel = kernel;
    out->pieces = p->coefficients;
    out->segments = p->coefficients + pieces_size(p, kernel);
    out->segment_step = (int32_t)coefficients_segment_size(kernel, p->header.axis_count);
    out->first_piece = 0;
    out->piece_count = p->header.piece_count;
    out->first_segment = 0;
    out->segment_count = p->header.segment_count;
}

void coefficients_attach(struct program *p, const struct kernel *kernel, const uint8_t *records)
{
    p->coefficients = records;
    p->coefficients_for = kernel;
}

static int append(void *context, const uint8_t *bytes, uint32_t size)
{
    uint8_t **to = context;
    memcpy(*to, bytes, size);
    *to += size;
    return 0;
}

int coefficients_make_in(struct program *p, const struct kernel *kernel, void *memory,
                         uint64_t size)
{
    uint8_t *to = memory;
    if (coefficients_size(p, kernel) > size) {
        return COEFFICIENTS_ERR_SIZE;
    }
    (void)coefficients_make(p, kernel, append, &to);
    coefficients_attach(p, kernel, memory);
    return 0;
}
