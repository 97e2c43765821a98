/* SPDX-License-Identifier: MIT */
/* Implements core/segment_check.h (see there): the rules of segments (docs/reference/protocol.md 1.2). A part of
 * program_check. Pure, main loop. */
#include "core/segment_check.h"

#include "core/joint_check.h"
#include "core/ph_segment.h"
#include "core/qmath.h"
#include "core/qwide.h"

#define W_LIMIT_Q44     ((int64_t)1 << 50) /* 2^6, of a component of the preimage */
#define POINT_LIMIT_Q40 ((int64_t)1 << 52) /* 2^12 mm */
#define ARC_LIMIT_Q40   ((int64_t)1 << 62) /* 2^22 mm */
#define JOIN_Q48        ((int64_t)1 << 14) /* 2^-34 mm */
#define CLOSED_Q48      ((int64_t)1 << 24) /* 2^-24 mm */
#define TRAVEL_Q48      ((int64_t)1 << 24) /* rounding of a path that runs along a limit */
#define LONGEST_MM      32

static int within(int64_t a, int64_t limit)
{
    return a < limit && a > -limit;
}

static int check_ranges(const struct program_segment *g)
{
    for (uint32_t c = 0; c < PROGRAM_COMPONENTS; c += program_component_step(g->axis_count)) {
        for (int k = 0; k < 3; k++) {
            if (!within(g->a_q44[c][k], W_LIMIT_Q44)) {
                return PROGRAM_ERR_W_RANGE;
            }
        }
    }
    for (uint32_t axis = 0; axis < program_curve_axes(g->axis_count); axis++) {
        if (!within(g->point_q40_mm[axis], POINT_LIMIT_Q40)) {
            return PROGRAM_ERR_POINT_RANGE;
        }
    }
    for (uint32_t k = 0; k < program_extra_axes(g->axis_count); k++) {
        if (!within(g->extra[k].start_q40, POINT_LIMIT_Q40)) {
            return PROGRAM_ERR_POINT_RANGE;
        }
    }
    if (g->start_q40_mm < 0 || g->start_q40_mm >= ARC_LIMIT_Q40) {
        return PROGRAM_ERR_ARC_RANGE;
    }
    return 0;
}

/* sum + weight <A_i, A_j>, exact */
static struct qwide add_dot(struct qwide sum, const struct program_segment *g, int i, int j,
                            int64_t weight)
{
    for (uint32_t c = 0; c < PROGRAM_COMPONENTS; c += program_component_step(g->axis_count)) {
        sum = qwide_add_product(sum, g->a_q44[c][i], g->a_q44[c][j], weight);
    }
    return sum;
}

/* Speed ratio and length, exact: three times the Bernstein coefficients of sigma in q88; a
 * fifteenth of their sum is the length. */
static int check_speed(const struct program_segment *g)
{
    const struct qwide zero = {0, 0};
    struct qwide sigma[5];
    sigma[0] = add_dot(zero, g, 0, 0, 3);
    sigma[1] = add_dot(zero, g, 0, 1, 3);
    sigma[2] = add_dot(add_dot(zero, g, 0, 2, 1), g, 1, 1, 2);
    sigma[3] = add_dot(zero, g, 1, 2, 3);
    sigma[4] = add_dot(zero, g, 2, 2, 3);
    struct qwide least = sigma[0];
    struct qwide greatest = sigma[0];
    struct qwide sum = sigma[0];
    for (int k = 1; k < 5; k++) {
        least = qwide_compare(sigma[k], least) < 0 ? sigma[k] : least;
        greatest = qwide_compare(sigma[k], greatest) > 0 ? sigma[k] : greatest;
        sum = qwide_add(sum, sigma[k]);
    }
    const struct qwide longest = {(int64_t)15 * LONGEST_MM << 38, 0};
    if (qwide_compare(least, zero) <= 0) {
        return PROGRAM_ERR_SIGMA;
    }
    if (qwide_compare(greatest, qwide_add(least, least)) > 0) {
        return PROGRAM_ERR_SIGMA_RATIO;
    }
    return qwide_compare(sum, longest) > 0 ? PROGRAM_ERR_SEGMENT_LONG : 0;
}

static int inside(int64_t a_q48, int64_t min_q40, int64_t max_q40)
{
    return ((a_q48 + TRAVEL_Q48) >> 8) >= min_q40 && ((a_q48 - TRAVEL_Q48) >> 8) <= max_q40;
}

/* Bezier control points: each is the one before plus a fifth of the Bernstein coefficient of r'. */
static int check_curve_travel(const struct program_segment *g, const struct program_limits *limits)
{
    int64_t e_q50[5][PH_AXES];
    ph_segment_hodograph(g, e_q50);
    for (uint32_t axis = 0; axis < program_curve_axes(g->axis_count); axis++) {
        int64_t point_q48 = g->point_q40_mm[axis] * 256;
        for (int k = 0; k <= 5; k++) {
            if (!inside(point_q48, limits->min_q40_mm[axis], limits->max_q40_mm[axis])) {
                return PROGRAM_ERR_TRAVEL;
            }
            if (k < 5) {
                int64_t fifth = qmath_fifth(e_q50[k][PH_X + (int)axis]);
                point_q48 += (k == 2 ? qmath_third(fifth) : fifth) >> 2;
            }
        }
    }
    return 0;
}

static int check_travel(const struct program_segment *g, const struct program_limits *limits)
{
    for (uint32_t i = 0; i < program_extra_axes(g->axis_count); i++) {
        const struct program_extra *extra = &g->extra[i];
        const int64_t min_q40 = limits->min_q40_mm[PROGRAM_SPACE + i];
        const int64_t max_q40 = limits->max_q40_mm[PROGRAM_SPACE + i];
        int fits = inside(extra->start_q40 * 256, min_q40, max_q40);
        for (int k = 0; k < 5; k++) {
            fits &= inside((extra->start_q40 + extra->b_q40[k]) * 256, min_q40, max_q40);
        }
        if (fits == 0) {
            return PROGRAM_ERR_TRAVEL;
        }
    }
    return check_curve_travel(g, limits);
}

/* The end of a segment against where it should be, both relative to its start; |target| < 2^54. */
static int meets(int64_t end_q48, int64_t target_q40, int64_t tolerance_q48)
{
    int64_t apart = end_q48 - target_q40 * 256;
    return apart <= tolerance_q48 && apart >= -tolerance_q48;
}

/* A distance that no segment has is refused first: no overflow in meets. */
static int meets_arc(int64_t start_q40, int64_t end_q48, int64_t target_q40)
{
    int64_t distance_q40 = target_q40 - start_q40;
    return distance_q40 > 0 && distance_q40 < ((int64_t)1 << 50) &&
           meets(end_q48, distance_q40, JOIN_Q48);
}

static int meets_point(const struct program_segment *a, const int64_t end_q48[PH_AXES],
                       const struct program_segment *b, int64_t tolerance_q48)
{
    for (uint32_t axis = 0; axis < program_curve_axes(a->axis_count); axis++) {
        if (!meets(end_q48[PH_X + (int)axis], b->point_q40_mm[axis] - a->point_q40_mm[axis],
                   tolerance_q48)) {
            return 0;
        }
    }
    for (uint32_t i = 0; i < program_extra_axes(a->axis_count); i++) {
        const struct program_extra *extra = &a->extra[i];
        if (!meets(extra->b_q40[4] * 256, b->extra[i].start_q40 - extra->start_q40,
                   tolerance_q48)) {
            return 0;
        }
    }
    return 1;
}

static int check_join(const struct program_segment *a, const struct program_segment *b)
{
    struct ph_segment ph;
    int64_t end_q48[PH_AXES];
    ph_segment_expand(&ph, a);
    ph_segment_end(&ph, end_q48);
    if (!meets_point(a, end_q48, b, JOIN_Q48)) {
        return PROGRAM_ERR_JOIN_POINT;
    }
    if (!meets_arc(a->start_q40_mm, end_q48[PH_S], b->start_q40_mm)) {
        return PROGRAM_ERR_JOIN_ARC;
    }
    return joint_goes_on(a, b) ? 0 : PROGRAM_ERR_JOIN_DIRECTION;
}

static int check_end(const struct program *p, const struct program_segment *first,
                     const struct program_segment *last)
{
    struct ph_segment ph;
    int64_t end_q48[PH_AXES];
    ph_segment_expand(&ph, last);
    ph_segment_end(&ph, end_q48);
    if (!meets_arc(last->start_q40_mm, end_q48[PH_S], p->header.length_q40_mm)) {
        return PROGRAM_ERR_SEGMENT_END;
    }
    if ((p->header.flags & PROGRAM_FLAG_CLOSED) != 0 &&
        !meets_point(last, end_q48, first, CLOSED_Q48)) {
        return PROGRAM_ERR_NOT_CLOSED;
    }
    return 0;
}

static int check_one(const struct program_segment *g, const struct program_limits *limits)
{
    int code = check_ranges(g);
    code = code != 0 ? code : check_speed(g);
    return code != 0 ? code : check_travel(g, limits);
}

int segment_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index)
{
    struct program_segment first = {0};
    struct program_segment before = {0};
    struct program_segment g;
    for (*index = 0; *index < p->header.segment_count; (*index)++) {
        program_segment_get(p, *index, &g);
        int code = check_one(&g, limits);
        if (code == 0 && *index == 0) {
            code = g.start_q40_mm == 0 ? 0 : PROGRAM_ERR_SEGMENT_FIRST;
            first = g;
        } else if (code == 0) {
            code = check_join(&before, &g);
        }
        if (code != 0) {
            return code;
        }
        before = g;
        program_limits_attend(limits);
    }
    *index = p->header.segment_count - 1u;
    return check_end(p, &first, &before);
}
