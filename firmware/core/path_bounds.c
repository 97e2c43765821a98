/* SPDX-License-Identifier: MIT */
/* Implements core/path_bounds.h (see there): bounds of how the axes move along the path, for a stretch of it. Used by
 * the proof of the stops (core/brake_check, for `hodograph verify`). Main loop. Changes only its struct; no I/O. */
#include "core/path_bounds.h"

#include <stddef.h>

#include "core/qmath.h"

#define LEAST_LOG2 3 /* of the number of parts of a segment, */
#define MOST_LOG2  6 /* and greatest */

/* Part `number` of 2^log2 of a segment. */
struct part {
    uint32_t segment;
    uint32_t number;
    int log2;
};

/* Of each derivative: at the start of the part, at its end, and the greatest distance from the straight line. */
enum number { BEGIN, END, ASIDE, NUMBERS };

void path_bounds_begin(struct path_bounds *bounds, const struct program *p)
{
    const uint32_t room = (uint32_t)(sizeof bounds->numbers / sizeof bounds->numbers[0]);
    bounds->program = p;
    bounds->segment = UINT32_MAX;
    bounds->size = p->header.axis_count * QUANTITIES * NUMBERS;
    bounds->kept = room / bounds->size;
    for (uint32_t i = 0; i < PATH_BOUNDS_KEPT; i++) {
        bounds->part_of[i] = 0;
    }
}

/* The derivatives at an arc length of the segment. */
static void derivatives_at(const struct path_bounds *bounds, struct real s_mm, struct motion *out)
{
    const struct real zero = {0, 0};
    struct real f[QUANTITIES];
    f[0] = real_make(1, 0);
    f[1] = zero;
    f[2] = zero;
    path_motion_at(&bounds->path, s_mm, f, out);
}

/* Rounded towards 0: by less than 2^-14 of it. */
static struct path_bounds_number kept_of(struct real a)
{
    const struct path_bounds_number out = {(int16_t)(a.m / 65536), (int16_t)(a.e + 16)};
    const struct path_bounds_number none = {0, 0};
    return a.m == 0 || a.e < -4096 ? none : out;
}

static struct real real_of(struct path_bounds_number a)
{
    return real_make(a.m, a.e);
}

static void take(struct path_bounds_number *numbers, enum number what, uint32_t axes,
                 const struct motion *from)
{
    for (uint32_t axis = 0; axis < axes; axis++) {
        for (uint32_t k = 0; k < QUANTITIES; k++) {
            numbers[(axis * QUANTITIES + k) * NUMBERS + (uint32_t)what] =
                kept_of(from->of[axis][k]);
        }
    }
}

/* How far from the straight line: M / 2, and the rounding of the numbers kept. */
static void set_aside(struct motion *out, const struct motion *begin, const struct motion *end,
                      uint32_t axes)
{
    for (uint32_t axis = 0; axis < axes; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            const struct real aside = real_scale(out->of[axis][k], -1);
            const struct real ends =
                real_max(real_abs(begin->of[axis][k]), real_abs(end->of[axis][k]));
            const struct real rounding = real_scale(real_add(aside, ends), -13);
            out->of[axis][k] = real_add(real_add(aside, rounding), real_make(1, -60));
        }
    }
}

/* Arc length from the middle of the part is x half, x from -1 to 1; |q''| <= M makes M / 2 between its ends. */
static void fill(struct path_bounds *bounds, struct path_bounds_number *numbers,
                 const struct part *part)
{
    const uint32_t axes = bounds->program->header.axis_count;
    const int32_t begin = 2 * (int32_t)part->number; /* in halves of parts */
    struct real poly[FEED_DEGREE + 1];
    struct motion ends[2];
    struct motion aside;
    if (part->segment != bounds->segment) {
        path_motion_read(&bounds->path, bounds->program, part->segment);
        bounds->segment = part->segment;
    }
    const struct real half = real_scale(bounds->path.length_mm, -1 - part->log2);
    poly[0] = real_times(half, begin + 1);
    poly[1] = half;
    for (int k = 2; k <= FEED_DEGREE; k++) {
        poly[k] = real_make(0, 0);
    }
    derivatives_at(bounds, real_times(half, begin), &ends[0]);
    derivatives_at(bounds, real_times(half, begin + 2), &ends[1]);
    path_motion_bend(&bounds->path, poly, real_div(real_make(1, 0), half), real_make(0, 0), &aside);
    set_aside(&aside, &ends[0], &ends[1], axes);
    take(numbers, BEGIN, axes, &ends[0]);
    take(numbers, END, axes, &ends[1]);
    take(numbers, ASIDE, axes, &aside);
}

static const struct path_bounds_number *part_numbers(struct path_bounds *bounds,
                                                     const struct part *part)
{
    /* 2^MOST_LOG2 places of a segment, and how many parts it has */
    const uint32_t place =
        (part->segment << MOST_LOG2) + (part->number << (MOST_LOG2 - part->log2));
    const uint32_t key = 4u * place + (uint32_t)(part->log2 - LEAST_LOG2) + 1u;
    const uint32_t at = ((part->segment << part->log2) + part->number) % bounds->kept;
    struct path_bounds_number *numbers = bounds->numbers + (size_t)at * bounds->size;
    if (bounds->part_of[at] != key) {
        fill(bounds, numbers, part);
        bounds->part_of[at] = key;
    }
    return numbers;
}

static void widen(struct span *out, struct real value, struct real aside)
{
    out->low = real_less(real_sub(value, aside), out->low) != 0 ? real_sub(value, aside) : out->low;
    out->high = real_max(out->high, real_add(value, aside));
}

/* From x to y of the part, both 0 to 1. */
static void add_part(struct path_stretch *out, const struct path_bounds_number *numbers,
                     uint32_t axes, struct real x, struct real y, int first)
{
    for (uint32_t axis = 0; axis < axes; axis++) {
        for (uint32_t k = 0; k < QUANTITIES; k++) {
            const struct path_bounds_number *own = numbers + (axis * QUANTITIES + k) * NUMBERS;
            const struct real begin = real_of(own[BEGIN]);
            const struct real rise = real_sub(real_of(own[END]), begin);
            const struct real aside = real_of(own[ASIDE]);
            const struct real at_x = real_add(begin, real_mul(rise, x));
            struct span *span = &out->of[axis][k];
            if (first != 0) {
                span->low = real_sub(at_x, aside);
                span->high = real_add(at_x, aside);
            } else {
                widen(span, at_x, aside);
            }
            widen(span, real_add(begin, real_mul(rise, y)), aside);
        }
    }
}

static int64_t segment_end(const struct program *p, uint32_t segment)
{
    return segment + 1u < p->header.segment_count ? program_segment_start(p, segment + 1u)
                                                  : p->header.length_q40_mm;
}

/* Share of a length, held at 0 and 1. */
static struct real share(int64_t part_q40, int64_t whole_q40)
{
    const int64_t held = qmath_lesser(qmath_greater(part_q40, 0), whole_q40);
    return real_div(real_make(held, 0), real_make(qmath_greater(whole_q40, 1), 0));
}

/* The parts of a segment that the stretch touches: no shorter than the stretch, if there are such. */
static void add_segment(struct path_bounds *bounds, uint32_t segment, int64_t from_q40,
                        int64_t to_q40, struct path_stretch *out, int first)
{
    const int64_t start = program_segment_start(bounds->program, segment);
    const int64_t length = segment_end(bounds->program, segment) - start;
    struct part part = {.segment = segment, .log2 = LEAST_LOG2};
    while (part.log2 < MOST_LOG2 && length >> (part.log2 + 1) >= to_q40 - from_q40) {
        part.log2++;
    }
    const uint32_t count = 1u << part.log2;
    const int64_t step = length >> part.log2;
    for (; part.number < count; part.number++) {
        const int64_t begin = start + step * part.number;
        const int64_t end = part.number + 1u < count ? begin + step : start + length;
        if (to_q40 < begin || from_q40 > end) {
            continue;
        }
        add_part(out, part_numbers(bounds, &part), bounds->program->header.axis_count,
                 share(from_q40 - begin, end - begin), share(to_q40 - begin, end - begin), first);
        first = 0;
    }
}

void path_bounds_of(struct path_bounds *bounds, uint32_t segment, int64_t from_q40_mm,
                    int64_t to_q40_mm, struct path_stretch *out)
{
    const struct program *p = bounds->program;
    const int64_t length = p->header.length_q40_mm;
    const int64_t from = qmath_lesser(qmath_greater(from_q40_mm, 0), length);
    const int64_t to = qmath_lesser(qmath_greater(to_q40_mm, from), length);
    uint32_t i = segment;
    int first = 1;
    while (i > 0 && program_segment_start(p, i) > from) {
        i--;
    }
    while (i + 1u < p->header.segment_count && segment_end(p, i) < from) {
        i++;
    }
    for (; i < p->header.segment_count && program_segment_start(p, i) <= to; i++) {
        add_segment(bounds, i, from, to, out, first);
        first = 0;
    }
}
