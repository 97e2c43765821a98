/* SPDX-License-Identifier: MIT */
/* Implements core/limit_check.h (see there): the proof that a program keeps the limits of its path axes. A part of
 * program_check. Main loop. Changes only its result; no I/O. */
#include "core/limit_check.h"

#include <stddef.h>

#include "core/path_motion.h"
#include "core/real.h"

#define PARTS_LOG2    5  /* a cell has 2^this parts */
#define MOST_HALVINGS 20 /* of a cell */
#define PLACE_STEPS   30 /* halvings of a piece's time to find a distance */

/* Never inlined, so that its frame is not on the stack while the caller calls program_limits_attend(). */
#if defined(__GNUC__)
#define CHECK_APART __attribute__((noinline))
#else
#define CHECK_APART
#endif

static const struct real zero = {0, 0};
static const int32_t factorials[QUANTITIES] = {1, 2, 6};

/* A stretch of a piece on a segment, u from middle - half to middle + half. */
struct cell {
    const struct path *path;
    /* F from the piece's start in powers of x = (u - middle) / half */
    struct real c[FEED_DEGREE + 1];
    struct real per_s;     /* d x / d t */
    struct real offset_mm; /* start of the piece from the start of the segment */
};

/* The override bounds of one level, and what follows from them. */
struct level {
    struct real f2; /* powers of f, the greatest override */
    struct real f3;
    struct real rate;   /* R, 1/s */
    struct real mixed;  /* 3 f R */
    struct real second; /* S, 1/s^2 */
};

/* The override bounds of one piece: those levels that no other one contains. */
struct levels {
    struct real greatest; /* override */
    struct level of[PROGRAM_LEVELS];
    uint32_t count;
};

struct check {
    const struct program *program;
    const struct program_limits *limits;
    uint32_t axis_count;
    struct levels levels;   /* of the present piece */
    struct motion limit;    /* m = 0: none */
    struct real per_period; /* 1/s */
    struct motion last;     /* at the end of the previous stretch; standstill before the first, */
    int unknown;            /* or not known: before a program that begins in motion */
};

/* --- The motion at an instant --- */

static void motion_at(const struct cell *cell, struct real x, struct motion *out)
{
    struct real c[FEED_DEGREE + 1];
    struct real f[QUANTITIES];
    struct real per_s = cell->per_s;
    for (int k = 0; k <= FEED_DEGREE; k++) {
        c[k] = cell->c[k];
    }
    path_motion_taylor(c, FEED_DEGREE, x, QUANTITIES + 1);
    for (int order = 0; order < QUANTITIES; order++) {
        f[order] = real_times(real_mul(c[order + 1], per_s), factorials[order]);
        per_s = real_mul(per_s, cell->per_s);
    }
    path_motion_at(cell->path, real_add(c[0], cell->offset_mm), f, out);
}

/* --- Against the limits --- */

static int64_t factor_q14(const struct program_override *own, uint32_t level)
{
    return level == PROGRAM_LEVEL_FULL ? own->factor_q14 : (int64_t)program_level_q9(level) * 32;
}

/* 1 when one level allows all that another one allows. */
static int contains(const struct program_override *own, uint32_t wide, uint32_t narrow)
{
    return factor_q14(own, wide) >= factor_q14(own, narrow) &&
           own->rate[wide] >= own->rate[narrow] && own->second[wide] >= own->second[narrow];
}

/* 1 when another level contains this one; of equal levels the first one stays. */
static int is_contained(const struct program_override *own, uint32_t level)
{
    for (uint32_t other = 0; other < PROGRAM_LEVELS; other++) {
        if (other != level && contains(own, other, level) &&
            (other < level || !contains(own, level, other))) {
            return 1;
        }
    }
    return 0;
}

static void read_levels(struct levels *levels, const struct program_override *own)
{
    levels->count = 0;
    levels->greatest = zero;
    for (uint32_t i = 0; i < PROGRAM_LEVELS; i++) {
        if (is_contained(own, i) != 0) {
            continue;
        }
        struct level *level = &levels->of[levels->count];
        const int64_t f_q14 = factor_q14(own, i);
        const struct real f = real_make(f_q14, -14);
        level->f2 = real_make(f_q14 * f_q14, -28);
        level->f3 = real_make(f_q14 * f_q14 * f_q14, -42);
        level->rate = real_make((int64_t)program_number(own->rate[i]), -32);
        level->mixed = real_times(real_mul(f, level->rate), 3);
        level->second = real_make((int64_t)program_number(own->second[i]), -24);
        levels->greatest = real_max(levels->greatest, f);
        levels->count++;
    }
}

/* At the overrides that the piece allows: |lambda| <= f, |lambda'| <= R, |lambda''| <= S make of velocity, acceleration
 * and jerk f v, f^2 a + R v and f^3 j + 3 f R a + S v at most: the greatest of all levels. Magnitudes out.
 * docs/theory/feed.md section 7. */
static void at_all_overrides(const struct levels *levels, struct real of[QUANTITIES])
{
    const struct real v = real_abs(of[VELOCITY]);
    const struct real a = real_abs(of[ACCELERATION]);
    const struct real j = real_abs(of[JERK]);
    if (v.m == 0 && a.m == 0 && j.m == 0) {
        return;
    }
    of[VELOCITY] = real_mul(levels->greatest, v);
    of[ACCELERATION] = zero;
    of[JERK] = zero;
    for (uint32_t i = 0; i < levels->count; i++) {
        const struct level *level = &levels->of[i];
        const struct real acceleration = real_add(real_mul(level->f2, a), real_mul(level->rate, v));
        const struct real jerk =
            real_add(real_add(real_mul(level->f3, j), real_mul(level->mixed, a)),
                     real_mul(level->second, v));
        of[ACCELERATION] = real_max(of[ACCELERATION], acceleration);
        of[JERK] = real_max(of[JERK], jerk);
    }
}

static int passes(struct real value, struct real limit)
{
    return limit.m != 0 && real_less(limit, value) != 0;
}

static const int codes[QUANTITIES] = {PROGRAM_ERR_AXIS_VELOCITY, PROGRAM_ERR_AXIS_ACCELERATION,
                                      PROGRAM_ERR_AXIS_JERK};

/* 0, or the code of the limit that a quantity with this bound above its sample may pass. */
static int judge(const struct check *check, const struct motion *sample, const struct motion *bend,
                 int32_t scale)
{
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            const struct real above = real_scale(bend->of[axis][k], scale);
            if (passes(real_add(sample->of[axis][k], above), check->limit.of[axis][k])) {
                return codes[k];
            }
        }
    }
    return 0;
}

/* The motion at x, at all overrides. Returns 0, or the code of a limit that it passes. */
static int take_sample(const struct check *check, const struct cell *cell, struct real x,
                       struct motion *out)
{
    int code = 0;
    path_motion_clear(out);
    motion_at(cell, x, out);
    for (uint32_t axis = 0; axis < check->axis_count && code == 0; axis++) {
        at_all_overrides(&check->levels, out->of[axis]);
        for (int k = QUANTITIES - 1; k >= 0; k--) {
            code = passes(out->of[axis][k], check->limit.of[axis][k]) ? codes[k] : code;
        }
    }
    return code;
}

/* The bounds of |q''| in a cell, at all overrides. */
static void bend_of(const struct check *check, const struct cell *cell, struct motion *bend)
{
    path_motion_clear(bend);
    path_motion_bend(cell->path, cell->c, cell->per_s, cell->offset_mm, bend);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        at_all_overrides(&check->levels, bend->of[axis]);
    }
}

/* One cell without halving, from sample to sample, each as far from the previous one as the limits allow. 0: the limits
 * are kept; else a code, with *certain set if a sample exceeds the limit. */
static int check_cell(const struct check *check, const struct cell *cell, int *certain)
{
    struct motion bend;
    struct motion samples[2];
    int last = 0;               /* which of the samples the next interval begins with */
    int32_t at = 0;             /* it begins at -1 + at / 2^(PARTS_LOG2 - 1) */
    int32_t width = PARTS_LOG2; /* log2 of its width in these parts */
    bend_of(check, cell, &bend);
    int code = take_sample(check, cell, real_make(-1, 0), &samples[last]);
    *certain = 1;
    while (code == 0 && at < 1 << PARTS_LOG2) {
        /* M h^2 / 8 with h = 2^(1 + width - PARTS_LOG2) */
        const int32_t scale = 2 * (width - PARTS_LOG2) - 1;
        int open = judge(check, &samples[last], &bend, scale);
        if (open == 0) {
            const int32_t next = 2 * (at + (1 << width)) - (1 << PARTS_LOG2);
            code = take_sample(check, cell, real_make(next, -PARTS_LOG2), &samples[1 - last]);
            open = code != 0 ? 0 : judge(check, &samples[1 - last], &bend, scale);
        }
        if (open != 0 && width == 0) {
            *certain = 0;
            return open;
        }
        if (open != 0) {
            width--;
        } else {
            at += 1 << width;
            last = 1 - last;
            if ((at & ((2 << width) - 1)) == 0 && width < PARTS_LOG2) {
                width++;
            }
        }
    }
    return code;
}

static void set_cell(struct cell *cell, const struct feed_polynomial *poly, const struct path *path,
                     struct real low, struct real high)
{
    const struct real half = real_scale(real_sub(high, low), -1);
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
    for (int step = 0; step < PLACE_STEPS; step++) {
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
    read_levels(&check->levels, &poly.override);
    while (next_start(p, *segment) <= poly.start_q40_mm) {
        (*segment)++;
    }
    path_motion_read(&path, p, *segment);
    while (code == 0 && next_start(p, *segment) != INT64_MAX) {
        const struct real mm = real_make(next_start(p, *segment) - poly.start_q40_mm, -40);
        if (real_less(mm, poly.end_mm) == 0) {
            break;
        }
        const struct real end = time_of(&poly, mm, low);
        if (real_less(brief, real_sub(end, low)) != 0) {
            code = check_stretch(check, &poly, &path, low, end);
            low = end;
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
