/* SPDX-License-Identifier: MIT */
/*
 * coefficients: coefficient records of a program for one kernel. The tick reads them in place, so it computes nothing
 * anew when it crosses the end of a segment or of a piece (docs/theory/numerics.md section 12, "Precomputed
 * coefficients"). Used by firmware/app, firmware/core and host tools: app/program_table, core/coefficient_cache and
 * host tools make the records, interpolator and program clock read them.
 *
 * The controller itself makes the records from a program that has passed program_check; they are never uploaded. They
 * hold native structs, so they are valid only for the binary that made them. Any context, if not stated otherwise.
 * Writes only to the memory or the sink that it is given; no I/O.
 *
 * A tick goes from record to record by the links in them. So it needs a window of records around its place: all records
 * of a program in a bank (coefficients_make), or a few of a chunk (core/coefficient_cache.h). If a window ends before
 * the program, its last link is 0, and a tick that needs the next record fails (INTERPOLATOR_ERR_JUMP).
 */
#ifndef HODOGRAPH_CORE_COEFFICIENTS_H
#define HODOGRAPH_CORE_COEFFICIENTS_H

#include <stddef.h>
#include <stdint.h>

#include "core/feed_piece.h"
#include "core/kernel.h"
#include "core/kernel_double.h"
#include "core/kernel_fixed.h"
#include "core/kernel_float.h"
#include "core/override_ramp.h"
#include "core/program.h"

#define COEFFICIENTS_ALIGNMENT 8u /* of the first record */

#define COEFFICIENTS_ERR_SIZE (-1) /* the memory is too small */

/* A record ends with the kernel's own part, which may be shorter than the union. */
struct coefficients_piece {
    uint64_t start_q42_s;
    uint64_t end_q42_s; /* of the last piece the duration */
    int32_t next;       /* bytes from this record to that of the next piece; 0: there is none */
    uint32_t number;    /* of the piece */
    /* Of the look-ahead windows that begin with it: their end, UINT64_MAX if they contain the last piece, */
    uint64_t ahead_end_q32_s[OVERRIDE_WINDOWS];
    struct program_override ahead[OVERRIDE_WINDOWS]; /* and their least bounds */
    union {
        struct feed_piece integers;
        struct kernel_double_piece doubles;
    } feed;
};

struct coefficients_segment {
    int64_t from_q40_mm; /* arc lengths that belong to it: from here, INT64_MIN in the first, */
    int64_t to_q40_mm;   /* to below here, INT64_MAX in the last */
    int16_t next;        /* bytes from this record to that of the next segment; 0: there is none; */
    int16_t back;        /* and to that of the one before */
    uint32_t number;     /* of the segment */
    union {
        struct kernel_fixed_segment fixed;
        struct kernel_float_segment floats;
        struct kernel_double_segment doubles;
        struct kernel_fixed_space fixed_space;
        struct kernel_float_space floats_space;
        struct kernel_double_space doubles_space;
    } path;
};

/* Bytes of a record. */
static inline uint32_t coefficients_piece_size(const struct kernel *kernel)
{
    return (uint32_t)(offsetof(struct coefficients_piece, feed) + kernel->piece_size);
}

static inline uint32_t coefficients_segment_size(const struct kernel *kernel, uint32_t axis_count)
{
    const struct kernel_path *path = kernel_path(kernel, axis_count);
    return (uint32_t)(offsetof(struct coefficients_segment, path) + path->segment_size +
                      path->extra_size * program_extra_axes(axis_count));
}

/* Bytes of all records of a program; may be above 2^32. */
uint64_t coefficients_size(const struct program *p, const struct kernel *kernel);

/* Takes the next bytes of the records; 0 or a negative error. */
typedef int coefficients_sink(void *context, const uint8_t *bytes, uint32_t size);

/* Makes all records, in order: those of the pieces, then those of the segments, each of one size. Gives the sink's
 * first error, or 0. Main loop; linear. */
int coefficients_make(const struct program *p, const struct kernel *kernel, coefficients_sink *sink,
                      void *context);

/* Gives the program these records, which must stay; aligned to COEFFICIENTS_ALIGNMENT. */
void coefficients_attach(struct program *p, const struct kernel *kernel, const uint8_t *records);

/* Makes all records in this memory, aligned to COEFFICIENTS_ALIGNMENT, and attaches them. Returns 0, or
 * COEFFICIENTS_ERR_SIZE where `size` is below coefficients_size. Main loop; linear. */
int coefficients_make_in(struct program *p, const struct kernel *kernel, void *memory,
                         uint64_t size);

/* A record of a program that has them for this kernel. */
static inline const struct coefficients_piece *
coefficients_piece_at(const struct program *p, const struct kernel *kernel, uint32_t i)
{
    const void *at = p->coefficients + (size_t)i * coefficients_piece_size(kernel);
    return (const struct coefficients_piece *)at; /* C++ requires the cast */
}

static inline const struct coefficients_segment *
coefficients_segment_at(const struct program *p, const struct kernel *kernel, uint32_t i)
{
    const void *at = p->coefficients +
                     (size_t)p->header.piece_count * coefficients_piece_size(kernel) +
                     (size_t)i * coefficients_segment_size(kernel, p->header.axis_count);
    return (const struct coefficients_segment *)at;
}

/* The record that a link leads to: itself where the link is 0. */
static inline const struct coefficients_piece *
coefficients_piece_next(const struct coefficients_piece *piece)
{
    const void *at = (const uint8_t *)piece + piece->next;
    return (const struct coefficients_piece *)at; /* C++ requires the cast */
}

static inline const struct coefficients_segment *
coefficients_segment_next(const struct coefficients_segment *segment)
{
    const void *at = (const uint8_t *)segment + segment->next;
    return (const struct coefficients_segment *)at;
}

static inline const struct coefficients_segment *
coefficients_segment_back(const struct coefficients_segment *segment)
{
    const void *at = (const uint8_t *)segment + segment->back;
    return (const struct coefficients_segment *)at;
}

/* --- A window of records: those of successive pieces and of successive segments of a program. Not a look-ahead
 * window (core/override_ramp.h). --- */

struct coefficients_window {
    const struct kernel *kernel;
    const uint8_t *pieces;   /* the record of the first piece, followed by the others; */
    const uint8_t *segments; /* of the first segment, */
    int32_t segment_step;    /* and bytes from each to the next one */
    uint32_t first_piece;
    uint32_t piece_count;
    uint32_t first_segment;
    uint32_t segment_count;
};

/* All records of a program that has them. */
void coefficients_window_of(struct coefficients_window *out, const struct program *p);

/* The record of a piece or a segment; NULL: it is not in the window. */
static inline const struct coefficients_piece *
coefficients_window_piece(const struct coefficients_window *w, uint32_t i)
{
    const void *at = NULL;
    if (i - w->first_piece < w->piece_count) { /* below the first one it wraps */
        at = w->pieces + (size_t)(i - w->first_piece) * coefficients_piece_size(w->kernel);
    }
    return (const struct coefficients_piece *)at;
}

static inline const struct coefficients_segment *
coefficients_window_segment(const struct coefficients_window *w, uint32_t i)
{
    const void *at = NULL;
    if (i - w->first_segment < w->segment_count) {
        at = w->segments + (ptrdiff_t)(i - w->first_segment) * w->segment_step;
    }
    return (const struct coefficients_segment *)at;
}

/* --- One record each; its links are 0. Main loop. --- */

/* Of a piece that begins at this program time. */
void coefficients_make_piece(struct coefficients_piece *out, const struct program *p,
                             const struct kernel *kernel, uint32_t i, uint64_t start_q42_s);
void coefficients_make_segment(struct coefficients_segment *out, const struct program *p,
                               const struct kernel *kernel, uint32_t i);

#endif
