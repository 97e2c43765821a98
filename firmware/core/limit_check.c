/* SPDX-License-Identifier: MIT */
/* Implements core/limit_check.h (see there): the proof that a program keeps the limits of its path axes. */
#include "core/limit_check.h"

#include <stddef.h>

#include "core/path_motion.h"
#include "core/real.h"

#define MOST_PARTS    32u
#define MOST_HALVINGS 20 /* of a cell */
#define CUT_STEPS     30

/* Never inlined, so that its frame is not on the stack while the caller calls program_limits_attend(). */
#if defined(__GNUC__)
#define CHECK_APART __attribute__((noinline))
#else
#define CHECK_APART
#endif

static const struct real zero = {0, 0};

/* A stretch of a piece on a segment, u from middle - half to middle + half. */
struct cell {
    const struct feed_polynomial *poly;
    const struct path *path;
    /* F from the piece's start in powers of x = (u - middle) / half */
    struct real c[FEED_DEGREE + 1];
    struct real per_s;     /* d x / d t */
    struct real offset_mm; /* start of the piece from the start of the segment */
};

struct check {
    const struct program *program;
    const struct program_limits *limits;
    uint32_t axis_count;
    struct motion limit;    /* m = 0: none */
    struct real per_period; /* 1/s */
    struct motion last;     /* at the end of the previous stretch; standstill before the first, */
    int unknown;            /* or not known: before a program that begins in motion */
};

/* --- The motion at an instant --- */

/* Derivatives 1 to 3 of F in time. */
static void feed_at(const struct cell *cell, struct real x, struct real f[QUANTITIES])
{
    struct real per_s = cell->per_s;
    struct real c[FEED_DEGREE + 1];
    for (int k = 0; k <= FEED_DEGREE; k++) {
        c[k] = cell->c[k];
    }
    for (int order = 0; order < QUANTITIES; order++) {
        const int degree = FEED_DEGREE - 1 - order;
        for (int k = 0; k <= degree; k++) {
            c[k] = real_times(c[k + 1], k + 1);
        }
        f[order] = real_mul(path_motion_horner(c, degree, x), per_s);
        per_s = real_mul(per_s, cell->per_s);
    }
}

static void motion_at(const struct cell *cell, struct real x, struct motion *out)
{
    struct real f[QUANTITIES];
    feed_at(cell, x, f);
    path_motion_at(cell->path,
                   real_add(path_motion_horner(cell->c, FEED_DEGREE, x), cell->offset_mm), f, out);
}

/* --- Against the limits --- */

/* The greatest of a quantity in one level. */
static void in_level(const struct program_override *own, uint32_t level,
                     const struct real at_one[QUANTITIES], struct real out[QUANTITIES])
{
    const int64_t f_q14 =
        level == PROGRAM_LEVEL_FULL ? own->factor_q14 : (int64_t)program_level_q9(level) * 32;
    const struct real f = real_make(f_q14, -14);
    const struct real f2 = real_make(f_q14 * f_q14, -28);
    const struct real f3 = real_make(f_q14 * f_q14 * f_q14, -42);
    const struct real rate = real_make((int64_t)program_number(own->rate[level]), -32);
    const struct real second = real_make((int64_t)program_number(own->second[level]), -24);
    const struct real mixed = real_times(real_mul(real_mul(f, rate), at_one[ACCELERATION]), 3);
    out[VELOCITY] = real_mul(f, at_one[VELOCITY]);
    out[ACCELERATION] =
        real_add(real_mul(f2, at_one[ACCELERATION]), real_mul(rate, at_one[VELOCITY]));
    out[JERK] =
        real_add(real_add(real_mul(f3, at_one[JERK]), mixed), real_mul(second, at_one[VELOCITY]));
}

/* At the overrides that the piece allows: |lambda| <= f, |lambda'| <= R, |lambda''| <= S make of velocity, acceleration
 * and jerk f v, f^2 a + R v and f^3 j + 3 f R a + S v at most: the greatest of all levels. Magnitudes in, magnitudes
 * out. docs/theory/numerics.md section 7. */
static void at_all_overrides(const struct feed_polynomial *poly,
                             const struct real at_one[QUANTITIES], struct real out[QUANTITIES])
{
    struct real magnitude[QUANTITIES];
    struct real own[QUANTITIES];
    for (int k = 0; k < QUANTITIES; k++) {
        magnitude[k] = real_abs(at_one[k]);
        out[k] = zero;
    }
    for (uint32_t level = 0; level < PROGRAM_LEVELS; level++) {
        in_level(&poly->override, level, magnitude, own);
        for (int k = 0; k < QUANTITIES; k++) {
            out[k] = real_max(out[k], own[k]);
        }
    }
}

static int passes(struct real value, struct real limit)
{
    return limit.m != 0 && real_less(limit, value) != 0;
}

static const int codes[QUANTITIES] = {PROGRAM_ERR_AXIS_VELOCITY, PROGRAM_ERR_AXIS_ACCELERATION,
                                      PROGRAM_ERR_AXIS_JERK};

/* Takes a sample into the peaks. 0, or the code of the limit that it passes. */
static int take_sample(const struct check *check, const struct cell *cell, struct real x,
                       struct motion *peak)
{
    struct motion found;
    path_motion_clear(&found);
    motion_at(cell, x, &found);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real values[QUANTITIES];
        at_all_overrides(cell->poly, found.of[axis], values);
        for (int k = 0; k < QUANTITIES; k++) {
            if (passes(values[k], check->limit.of[axis][k])) {
                return codes[k];
            }
            peak->of[axis][k] = real_max(peak->of[axis][k], values[k]);
        }
    }
    return 0;
}

/* 0 if no limit can be exceeded between samples 2 / parts apart in x, else the code of a limit that may be. */
static int judge(const struct check *check, const struct motion *peak, const struct motion *rise,
                 uint32_t parts_log2)
{
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            /* M h^2 / 8 with h = 2 / parts */
            const struct real between = real_scale(rise->of[axis][k], -1 - 2 * (int32_t)parts_log2);
            if (passes(real_add(peak->of[axis][k], between), check->limit.of[axis][k])) {
                return codes[k];
            }
        }
    }
    return 0;
}

/* One cell without halving. 0: the limits are kept; else a code, with *certain set if a sample exceeds the limit. */
static int check_cell(const struct check *check, const struct cell *cell, int *certain)
{
    struct motion bend;
    struct motion peak;
    int code = 0;
    path_motion_clear(&peak);
    path_motion_clear(&bend);
    path_motion_bend(cell->path, cell->c, cell->per_s, cell->offset_mm, &bend);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real values[QUANTITIES];
        at_all_overrides(cell->poly, bend.of[axis], values);
        for (int k = 0; k < QUANTITIES; k++) {
            bend.of[axis][k] = values[k];
        }
    }
    *certain = 1;
    for (uint32_t log2 = 0; (1u << log2) <= MOST_PARTS; log2++) {
        const uint32_t parts = 1u << log2;
        for (uint32_t i = 0; i <= parts; i++) {
            if (log2 == 0u || (i & 1u) != 0u) { /* the others have been evaluated */
                const int32_t at = 2 * (int32_t)i - (int32_t)parts;
                code = take_sample(check, cell, real_make(at, -(int32_t)log2), &peak);
                if (code != 0) {
                    return code;
                }
            }
        }
        code = judge(check, &peak, &bend, log2);
        if (code == 0) {
            return 0;
        }
    }
    *certain = 0;
    return code;
}

static void set_cell(struct cell *cell, const struct feed_polynomial *poly, const struct path *path,
                     struct real low, struct real high)
{
    const struct real half = real_scale(real_sub(high, low), -1);
    cell->poly = poly;
    cell->path = path;
    for (int k = 0; k <= FEED_DEGREE; k++) {
        cell->c[k] = poly->c[k];
    }
    path_motion_shift(cell->c, FEED_DEGREE, real_scale(real_add(low, high), -1));
    path_motion_stretch(cell->c, FEED_DEGREE, half);
    cell->per_s = real_div(poly->per_s, half);
    cell->offset_mm = real_make(poly->start_q40_mm - path->start_q40_mm, -40);
}

/* Steps from the end of the previous cell to the start of this one: to a drive a step of velocity is an acceleration of
 * step / period, and so on. */
static int check_step(const struct check *check, const struct motion *now)
{
    const struct real share = real_div(real_make(LIMIT_CHECK_STEP_PERMILLE, 0), real_make(1000, 0));
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real step[QUANTITIES];
        for (int k = VELOCITY; k <= ACCELERATION; k++) {
            step[k] = real_abs(real_sub(now->of[axis][k], check->last.of[axis][k]));
        }
        const struct real jump = real_mul(step[VELOCITY], check->per_period);
        const struct real jerk = real_mul(real_add(jump, step[ACCELERATION]), check->per_period);
        if (passes(jump, real_mul(check->limit.of[axis][ACCELERATION], share)) ||
            passes(jerk, real_mul(check->limit.of[axis][JERK], share))) {
            return PROGRAM_ERR_AXIS_STEP;
        }
    }
    return 0;
}

/* The start of a stretch compared with the end of the previous one. */
static CHECK_APART int check_begin(struct check *check, const struct feed_polynomial *poly,
                                   const struct path *path, struct real low, struct real high)
{
    struct cell cell;
    struct motion now;
    path_motion_clear(&now);
    set_cell(&cell, poly, path, low, high);
    motion_at(&cell, real_make(-1, 0), &now);
    const int code = check->unknown != 0 ? 0 : check_step(check, &now);
    check->unknown = 0;
    motion_at(&cell, real_make(1, 0), &check->last);
    return code;
}

/* A part of a stretch without halving; the result and *certain are those of check_cell. */
static CHECK_APART int check_part(const struct check *check, const struct feed_polynomial *poly,
                                  const struct path *path, struct real low, struct real high,
                                  int *certain)
{
    struct cell cell;
    set_cell(&cell, poly, path, low, high);
    return check_cell(check, &cell, certain);
}

/* The stretch of a piece on one segment, halved where necessary. */
static int check_stretch(struct check *check, const struct feed_polynomial *poly,
                         const struct path *path, struct real low, struct real high)
{
    const struct real width = real_sub(high, low);
    uint32_t at = 0; /* the part from at to at + 1 of 2^halvings */
    int32_t halvings = 0;
    int code = check_begin(check, poly, path, low, high);
    while (code == 0 && (at >> halvings) == 0u) {
        int certain = 0;
        const struct real part = real_scale(width, -halvings);
        const struct real from = real_add(low, real_times(part, (int32_t)at));
        program_limits_attend(check->limits); /* near a limit a piece may have very many parts */
        code = check_part(check, poly, path, from, real_add(from, part), &certain);
        if (code == 0) {
            at++;
            while ((at & 1u) == 0u && halvings > 0) {
                at >>= 1;
                halvings--;
            }
        } else if (certain == 0 && halvings < MOST_HALVINGS) {
            at <<= 1;
            halvings++;
            code = 0;
        }
    }
    return code;
}

/* u at which the piece is at this distance from its start, between `low` and 1. */
static struct real time_of(const struct feed_polynomial *poly, struct real mm, struct real low)
{
    struct real high = real_make(1, 0);
    for (int step = 0; step < CUT_STEPS; step++) {
        const struct real middle = real_scale(real_add(low, high), -1);
        if (real_less(path_motion_horner(poly->c, FEED_DEGREE, middle), mm) != 0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return high;
}

static int64_t next_start(const struct program *p, uint32_t segment)
{
    return segment + 1u < p->header.segment_count ? program_segment_start(p, segment + 1u)
                                                  : INT64_MAX;
}

/* One piece, from the segment that it begins on; *segment is then the one that it ends on. */
static int check_piece(struct check *check, uint32_t piece, uint32_t *segment)
{
    const struct program *p = check->program;
    const struct real brief = real_make(1, -26);
    struct real low = zero;
    struct feed_polynomial poly;
    struct path path;
    int code = 0;
    path_motion_read_piece(&poly, p, piece);
    while (next_start(p, *segment) <= poly.start_q40_mm) {
        (*segment)++;
    }
    path_motion_read(&path, p, *segment);
    while (code == 0 && next_start(p, *segment) != INT64_MAX) {
        const struct real mm = real_make(next_start(p, *segment) - poly.start_q40_mm, -40);
        if (real_less(mm, poly.end_mm) == 0) {
            break;
        }
        const struct real cut = time_of(&poly, mm, low);
        if (real_less(brief, real_sub(cut, low)) != 0) {
            code = check_stretch(check, &poly, &path, low, cut);
            low = cut;
        }
        (*segment)++;
        path_motion_read(&path, p, *segment);
    }
    if (code == 0 && real_less(brief, real_sub(real_make(1, 0), low)) != 0) {
        code = check_stretch(check, &poly, &path, low, real_make(1, 0));
    }
    return code;
}

int limit_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index)
{
    struct motion rest;
    struct check check = {.program = p, .limits = limits, .axis_count = p->header.axis_count};
    uint32_t segment = 0;
    int code = 0;
    const int any = path_motion_limits(&check.limit, limits, check.axis_count);
    path_motion_clear(&rest);
    check.last = rest;
    check.unknown = (p->header.flags & PROGRAM_FLAG_MOVING) != 0;
    check.per_period = real_div(real_make(1000000, 0), real_make((int64_t)p->header.period_us, 0));
    *index = 0;
    if (any == 0) {
        return 0;
    }
    for (uint32_t i = 0; i < p->header.piece_count && code == 0; i++) {
        *index = i;
        code = check_piece(&check, i, &segment);
    }
    code = code != 0 ? code : check_step(&check, &rest);
    *index = code != 0 ? *index : 0u;
    return code;
}
