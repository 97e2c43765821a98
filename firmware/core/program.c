/* SPDX-License-Identifier: MIT */
/* Implements core/program.h (see there): reading header, segments, feed pieces and stops of a program image. Used by
 * firmware/core, firmware/app, sim/offline and host tools. Any context. Reads the image; changes only its arguments; no
 * I/O. */
#include "core/program.h"

#include <stddef.h>
#include <string.h>

#include "core/crc32.h"
#include "core/little_endian.h"
#include "core/qmath.h"

#define CRC_FROM 16u /* the CRC covers everything after itself */

/* Where fields of compact records begin, protocol.md 1.7.1. */
#define COMPACT_POINT        7u  /* of a segment */
#define COMPACT_COEFFICIENTS 7u  /* of an extra axis */
#define COMPACT_START        4u  /* of a piece */
#define COMPACT_POWERS       11u /* coefficients of arc length */
#define COMPACT_OVERRIDE     53u /* override bounds */
#define COMPACT_BOUNDS       6u  /* of a stop */

static void read_header(struct program_header *h, const uint8_t *b)
{
    h->version = (uint16_t)read_u16(b + 4);
    h->header_size = (uint16_t)read_u16(b + 6);
    h->image_size = read_u32(b + 8);
    h->crc32 = read_u32(b + 12);
    h->period_us = read_u32(b + 16);
    h->segment_count = read_u32(b + 20);
    h->piece_count = read_u32(b + 24);
    h->flags = (uint16_t)read_u16(b + 28);
    h->axis_count = (uint16_t)read_u16(b + 30);
    h->duration_q32_s = read_u64(b + 32);
    h->length_q40_mm = read_i64(b + 40);
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        h->offset_q40_mm[axis] = axis < PROGRAM_PLANE ? read_i64(b + 48 + 8 * (size_t)axis) : 0;
    }
    h->feed_limit_um_s = read_u32(b + 64);
    h->acceleration_limit_um_s2 = read_u32(b + 68);
    h->jerk_limit_mm_s3 = read_u32(b + 72);
    h->event_count = read_u32(b + 76);
    memcpy(h->name, b + 80, 32);
    h->name[32] = '\0';
    h->hold_worst_us = read_u32(b + 112);
    h->hold_worst_um = read_u32(b + 116);
    h->fault_worst_us = read_u32(b + 120);
    h->fault_worst_um = read_u32(b + 124);
}

/* Those of the axes after y stand after the header of a planar program. */
static void read_offsets(struct program_header *h, const uint8_t *b)
{
    for (uint32_t axis = PROGRAM_PLANE; axis < h->axis_count; axis++) {
        h->offset_q40_mm[axis] =
            read_i64(b + PROGRAM_HEADER_SIZE + 8u * (size_t)(axis - PROGRAM_PLANE));
    }
}

uint32_t program_header_size(uint32_t axis_count)
{
    return PROGRAM_HEADER_SIZE + 8u * (axis_count - PROGRAM_PLANE);
}

uint32_t program_segment_size(uint32_t axis_count)
{
    return axis_count == PROGRAM_PLANE
               ? PROGRAM_SEGMENT_SIZE
               : PROGRAM_SPACE_SIZE + PROGRAM_EXTRA_SIZE * (axis_count - PROGRAM_SPACE);
}

uint32_t program_compact_segment_size(uint32_t axis_count)
{
    return axis_count == PROGRAM_PLANE
               ? PROGRAM_COMPACT_SEGMENT_SIZE
               : PROGRAM_COMPACT_SPACE_SIZE +
                     PROGRAM_COMPACT_EXTRA_SIZE * (axis_count - PROGRAM_SPACE);
}

static int is_compact(const struct program_header *h)
{
    return (h->flags & PROGRAM_FLAG_COMPACT) != 0u;
}

/* Bytes of a segment's record; below of a piece and of a stop. */
static uint32_t segment_size(const struct program_header *h)
{
    return is_compact(h) ? program_compact_segment_size(h->axis_count)
                         : program_segment_size(h->axis_count);
}

static uint32_t piece_size(const struct program_header *h)
{
    return is_compact(h) ? PROGRAM_COMPACT_PIECE_SIZE : PROGRAM_PIECE_SIZE;
}

static uint32_t stop_size(const struct program_header *h)
{
    return is_compact(h) ? PROGRAM_COMPACT_STOP_SIZE : PROGRAM_STOP_SIZE;
}

/* Counts that cannot fit are refused before they are multiplied, so nothing wraps. */
static int check_size(const struct program_header *h, uint32_t size)
{
    if (h->image_size > size || h->image_size < h->header_size) {
        return PROGRAM_ERR_SIZE;
    }
    uint64_t need = h->header_size + (uint64_t)h->segment_count * segment_size(h) +
                    (uint64_t)h->piece_count * (piece_size(h) + stop_size(h)) +
                    (uint64_t)h->event_count * PROGRAM_EVENT_SIZE;
    if (need != h->image_size) {
        return PROGRAM_ERR_SIZE;
    }
    return h->segment_count == 0 || h->piece_count == 0 ? PROGRAM_ERR_COUNT : 0;
}

static int check_format(const struct program_header *h)
{
    if (h->version != PROGRAM_VERSION) {
        return PROGRAM_ERR_VERSION;
    }
    if (h->axis_count < PROGRAM_PLANE || h->axis_count > PROGRAM_AXES) {
        return PROGRAM_ERR_AXES;
    }
    return h->header_size == program_header_size(h->axis_count) ? 0 : PROGRAM_ERR_VERSION;
}

int program_open(struct program *p, const uint8_t *image, uint32_t size)
{
    if (image == NULL || size < PROGRAM_HEADER_SIZE) {
        return PROGRAM_ERR_SIZE;
    }
    if (memcmp(image, "HDGP", 4) != 0) {
        return PROGRAM_ERR_MAGIC;
    }
    read_header(&p->header, image);
    int err = check_format(&p->header);
    err = err != 0 ? err : check_size(&p->header, size);
    if (err != 0) {
        return err;
    }
    read_offsets(&p->header, image);
    p->image = image;
    p->coefficients = NULL;
    p->coefficients_for = NULL;
    p->size = p->header.image_size;
    uint32_t crc = crc32_update(0, image + CRC_FROM, p->size - CRC_FROM);
    return crc == p->header.crc32 ? 0 : PROGRAM_ERR_CRC;
}

static const uint8_t *segment_bytes(const struct program *p, uint32_t i)
{
    return p->image + p->header.header_size + (size_t)i * segment_size(&p->header);
}

static const uint8_t *piece_bytes(const struct program *p, uint32_t i)
{
    return segment_bytes(p, p->header.segment_count) + (size_t)i * piece_size(&p->header);
}

static const uint8_t *stop_bytes(const struct program *p, uint32_t i)
{
    return piece_bytes(p, p->header.piece_count) + (size_t)i * stop_size(&p->header);
}

void program_stop_get(const struct program *p, uint32_t i, enum program_stop_kind kind,
                      struct program_stop *out)
{
    const uint8_t *b = stop_bytes(p, i);
    const uint8_t *codes = kind == PROGRAM_STOP_FAULT ? b + 3 : b;
    out->jerk_down = codes[0];
    out->deceleration = codes[1];
    out->jerk_up = codes[2];
    if (is_compact(&p->header)) {
        const uint8_t *bounds = b + COMPACT_BOUNDS;
        out->reserved = 0;
        out->bound_us = read_u24(kind == PROGRAM_STOP_FAULT ? bounds + 3 : bounds);
        return;
    }
    out->reserved = (uint16_t)read_u16(b + 6);
    out->bound_us = read_u32(kind == PROGRAM_STOP_FAULT ? b + 12 : b + 8);
}

static const uint8_t *event_bytes(const struct program *p, uint32_t i)
{
    return stop_bytes(p, p->header.piece_count) + (size_t)i * PROGRAM_EVENT_SIZE;
}

void program_event_get(const struct program *p, uint32_t i, struct program_event *out)
{
    const uint8_t *b = event_bytes(p, i);
    out->place_q40_mm = read_i64(b);
    out->kind = b[8];
    out->channel = b[9];
    out->mask = (uint16_t)read_u16(b + 10);
    out->value = (int32_t)read_u32(b + 12);
}

int64_t program_event_place(const struct program *p, uint32_t i)
{
    return read_i64(event_bytes(p, i));
}

uint32_t program_first_event_from(const struct program *p, int64_t arc_length_q40_mm)
{
    uint32_t low = 0;
    uint32_t high = p->header.event_count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2u;
        if (program_event_place(p, middle) < arc_length_q40_mm) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

int64_t program_segment_start(const struct program *p, uint32_t i)
{
    const uint8_t *b = segment_bytes(p, i);
    return is_compact(&p->header) ? read_i56(b) : read_i64(b);
}

uint64_t program_piece_duration(const struct program *p, uint32_t i)
{
    const uint8_t *b = piece_bytes(p, i);
    return is_compact(&p->header) ? read_u32(b) : read_u64(b);
}

int64_t program_piece_start(const struct program *p, uint32_t i)
{
    const uint8_t *b = piece_bytes(p, i);
    return is_compact(&p->header) ? read_i56(b + COMPACT_START) : read_i64(b + 8);
}

static int same(const int64_t *a, const int64_t *b, uint32_t count)
{
    int out = 1;
    for (uint32_t i = 0; i < count; i++) {
        out = out && a[i] == b[i];
    }
    return out;
}

int program_segment_alike(const struct program *a, uint32_t i, const struct program *b, uint32_t k)
{
    struct program_segment one;
    struct program_segment other;
    program_segment_get(a, i, &one);
    program_segment_get(b, k, &other);
    int out = same(one.point_q40_mm, other.point_q40_mm, PROGRAM_SPACE);
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
        out = out && same(one.a_q44[component], other.a_q44[component], 3u);
    }
    for (uint32_t axis = 0; axis < program_extra_axes(a->header.axis_count); axis++) {
        out = out && one.extra[axis].start_q40 == other.extra[axis].start_q40 &&
              same(one.extra[axis].b_q40, other.extra[axis].b_q40, 5u);
    }
    return out;
}

int program_piece_alike(const struct program *a, uint32_t i, const struct program *b, uint32_t k)
{
    struct program_piece one;
    struct program_piece other;
    program_piece_get(a, i, &one);
    program_piece_get(b, k, &other);
    const struct program_override *x = &one.override;
    const struct program_override *y = &other.override;
    return one.duration_q32_s == other.duration_q32_s && same(one.c_q40_mm, other.c_q40_mm, 7u) &&
           x->factor_q14 == y->factor_q14 && memcmp(x->rate, y->rate, sizeof x->rate) == 0 &&
           memcmp(x->second, y->second, sizeof x->second) == 0;
}

void program_piece_override(const struct program *p, uint32_t i, struct program_override *out)
{
    const uint8_t *b = piece_bytes(p, i) + (is_compact(&p->header) ? COMPACT_OVERRIDE : 72u);
    out->factor_q14 = (uint16_t)read_u16(b);
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        out->rate[k] = b[2u + k];
        out->second[k] = b[9u + k];
    }
}

uint64_t program_number(uint8_t code)
{
    static const uint32_t eighth_q16[8] = {65536u, 71468u,  77935u,  84990u,
                                           92681u, 101070u, 110217u, 120193u};
    return (uint64_t)eighth_q16[code & 7u] << (code >> 3);
}

static void read_planar(const uint8_t *b, struct program_segment *out)
{
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        out->point_q40_mm[axis] = read_i64(b + 8 + 8 * (size_t)axis);
    }
    out->point_q40_mm[PROGRAM_PLANE] = 0;
    for (int k = 0; k < 3; k++) {
        out->a_q44[PROGRAM_U][k] = read_i64(b + 24 + 16 * k);
        out->a_q44[PROGRAM_V][k] = 0;
        out->a_q44[PROGRAM_P][k] = 0;
        out->a_q44[PROGRAM_Q][k] = read_i64(b + 32 + 16 * k);
    }
}

/* Reads preimage coefficients of 48 bits: those of a segment in space, and of a compact one. */
static void read_preimage(const uint8_t *b, uint32_t axis_count, struct program_segment *out)
{
    const uint32_t step = program_component_step(axis_count);
    for (size_t k = 0; k < 3; k++) {
        for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
            const int is_there = component % step == 0u;
            out->a_q44[component][k] = is_there ? read_i48(b) : 0;
            b += is_there ? 6 : 0;
        }
    }
}

static void read_extra(const uint8_t *b, int64_t start_q40, struct program_extra *out)
{
    out->start_q40 = start_q40;
    for (int k = 0; k < 5; k++) {
        out->b_q40[k] = read_i48(b + 6 * k);
    }
}

static void read_spatial(const uint8_t *b, struct program_segment *out)
{
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        out->point_q40_mm[axis] = read_i64(b + 8 + 8 * (size_t)axis);
    }
    read_preimage(b + 32, out->axis_count, out);
    for (uint32_t k = PROGRAM_SPACE; k < out->axis_count; k++) {
        const size_t extra = k - PROGRAM_SPACE;
        const uint8_t *at = b + PROGRAM_SPACE_SIZE + PROGRAM_EXTRA_SIZE * extra;
        read_extra(at + 8, read_i64(at), &out->extra[extra]);
    }
}

static void read_compact(const uint8_t *b, struct program_segment *out)
{
    const uint32_t curve_axes = program_curve_axes(out->axis_count);
    out->point_q40_mm[PROGRAM_PLANE] = 0;
    for (uint32_t axis = 0; axis < curve_axes; axis++) {
        out->point_q40_mm[axis] = read_i56(b + COMPACT_POINT + 7u * (size_t)axis);
    }
    read_preimage(b + COMPACT_POINT + 7u * (size_t)curve_axes, out->axis_count, out);
    for (uint32_t k = PROGRAM_SPACE; k < out->axis_count; k++) {
        const size_t extra = k - PROGRAM_SPACE;
        const uint8_t *at = b + PROGRAM_COMPACT_SPACE_SIZE + PROGRAM_COMPACT_EXTRA_SIZE * extra;
        read_extra(at + COMPACT_COEFFICIENTS, read_i56(at), &out->extra[extra]);
    }
}

void program_segment_get(const struct program *p, uint32_t i, struct program_segment *out)
{
    const uint8_t *b = segment_bytes(p, i);
    out->start_q40_mm = program_segment_start(p, i);
    out->axis_count = p->header.axis_count;
    if (is_compact(&p->header)) {
        read_compact(b, out);
    } else if (out->axis_count == PROGRAM_PLANE) {
        read_planar(b, out);
    } else {
        read_spatial(b, out);
    }
}

void program_piece_get(const struct program *p, uint32_t i, struct program_piece *out)
{
    const uint8_t *b = piece_bytes(p, i);
    const int compact = is_compact(&p->header);
    out->duration_q32_s = program_piece_duration(p, i);
    out->start_q40_mm = program_piece_start(p, i);
    for (int k = 0; k < 7; k++) {
        out->c_q40_mm[k] =
            compact ? read_i48(b + COMPACT_POWERS + 6 * k) : read_i64(b + 16 + 8 * k);
    }
    program_piece_override(p, i, &out->override);
    out->override_factor_q24 = (uint32_t)out->override.factor_q14 << 10;
    out->override_rate_q16_per_s =
        (uint32_t)(program_number(out->override.rate[PROGRAM_LEVEL_FULL]) >> 16);
    out->override_second_q8_per_s2 =
        (uint32_t)(program_number(out->override.second[PROGRAM_LEVEL_FULL]) >> 16);
}

uint32_t program_ticks(const struct program *p)
{
    /* duration / period = (duration / 2^26) * 15625 / period_us, since 2^32 / 10^6 = 2^26 / 15625
     */
    uint64_t d = p->header.duration_q32_s;
    uint64_t low = (d & ((1u << 26) - 1u)) * 15625u;
    uint64_t us = (d >> 26) * 15625u + ((low + (1u << 26) - 1u) >> 26);
    return (uint32_t)qmath_div_u64(us + p->header.period_us - 1u, p->header.period_us) + 1u;
}

int program_piece_exponent(uint64_t duration_q32_s)
{
    int bits = duration_q32_s <= 1u ? 0 : 64 - qmath_clz64(duration_q32_s - 1u);
    return bits - 32 > 31 ? 31 : bits - 32;
}
