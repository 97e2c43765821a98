/* SPDX-License-Identifier: MIT */
/* Implements core/joint_check.h (see there): whether the direction of a path is continuous from a segment to the next.
 * Used by core/segment_check. Pure, main loop. */
#include "core/joint_check.h"

#include "core/qwide.h"
#include "core/real.h"

#define DIRECTION_BITS 21 /* the preimage turns by half the angle: 2^-21 rad */
#define SLOPE_BITS     20 /* of an extra axis: 2^-20 of one and the slope */

/* w2 of one and w0 of the next segment are parallel, either sign: the curve's direction is that of
 * w^2. */
static int same_direction_in_plane(const struct program_segment *a, const struct program_segment *b)
{
    const struct qwide zero = {0, 0};
    const int64_t *au = a->a_q44[PROGRAM_U];
    const int64_t *aq = a->a_q44[PROGRAM_Q];
    const int64_t *bu = b->a_q44[PROGRAM_U];
    const int64_t *bq = b->a_q44[PROGRAM_Q];
    struct qwide cross = qwide_add_product(zero, au[2], bq[0], 1);
    cross = qwide_add_product(cross, aq[2], bu[0], -1);
    struct qwide dot = qwide_add_product(zero, au[2], bu[0], 1);
    dot = qwide_add_product(dot, aq[2], bq[0], 1);
    return qwide_compare(qwide_abs(cross), qwide_shift_down(qwide_abs(dot), DIRECTION_BITS)) <= 0;
}

/* The square of an exact sum of products, within 2^-27 of itself. */
static struct real square_of(struct qwide a)
{
    const struct qwide size = qwide_abs(a);
    const struct real value = real_add(real_make(size.high, 50), real_make(size.low, 0));
    return real_mul(value, value);
}

/* The sum of sign A_first B_second over four terms: A the last preimage of one segment, B the first of another. */
static struct qwide form_of(const struct program_segment *a, const struct program_segment *b,
                            const int8_t terms[4][3])
{
    struct qwide sum = {0, 0};
    for (int i = 0; i < 4; i++) {
        sum =
            qwide_add_product(sum, a->a_q44[terms[i][0]][2], b->a_q44[terms[i][1]][0], terms[i][2]);
    }
    return sum;
}

/* With A* B = c0 + c1 i + c2 j + c3 k the tangents A i A* and B i B* are apart by an angle t with
 * tan^2 (t / 2) = (c2^2 + c3^2) / (c0^2 + c1^2). */
static int same_direction_in_space(const struct program_segment *a, const struct program_segment *b)
{
    enum { U = PROGRAM_U, V = PROGRAM_V, P = PROGRAM_P, Q = PROGRAM_Q };
    static const int8_t forms[4][4][3] = {
        {{U, U, 1}, {V, V, 1}, {P, P, 1}, {Q, Q, 1}},
        {{U, V, 1}, {V, U, -1}, {P, Q, -1}, {Q, P, 1}},
        {{U, P, 1}, {P, U, -1}, {Q, V, -1}, {V, Q, 1}},
        {{U, Q, 1}, {Q, U, -1}, {V, P, -1}, {P, V, 1}},
    };
    struct real squares[4];
    for (int i = 0; i < 4; i++) {
        squares[i] = square_of(form_of(a, b, forms[i]));
    }
    const struct real along = real_add(squares[0], squares[1]);
    const struct real across = real_add(squares[2], squares[3]);
    return real_less(real_scale(along, -2 * DIRECTION_BITS), across) == 0;
}

/* 5 / sigma at an end of a segment: that of coefficient 0 or 2 of the preimage. */
static struct real five_per_speed(const struct program_segment *g, int coefficient)
{
    struct qwide sigma = {0, 0};
    for (uint32_t c = 0; c < PROGRAM_COMPONENTS; c++) {
        sigma = qwide_add_product(sigma, g->a_q44[c][coefficient], g->a_q44[c][coefficient], 1);
    }
    return real_div(real_make(5, 0),
                    real_add(real_make(sigma.high, 50 - 88), real_make(sigma.low, -88)));
}

/* The slopes of the extra axes by arc length are continuous: within 2^-20 of (1 + slope), and the effect of four units
 * of the coefficients. */
static int same_slopes(const struct program_segment *a, const struct program_segment *b)
{
    const struct real per_end = five_per_speed(a, 2);
    const struct real per_start = five_per_speed(b, 0);
    const struct real rounding = real_scale(real_add(per_end, per_start), 2 - 40);
    for (uint32_t i = 0; i < program_extra_axes(a->axis_count); i++) {
        const int64_t *end = a->extra[i].b_q40;
        const struct real last = real_mul(real_make(end[4] - end[3], -40), per_end);
        const struct real first = real_mul(real_make(b->extra[i].b_q40[0], -40), per_start);
        const struct real one = real_add(real_make(1, 0), real_abs(last));
        const struct real most = real_add(real_scale(one, -SLOPE_BITS), rounding);
        if (real_less(most, real_abs(real_sub(first, last))) != 0) {
            return 0;
        }
    }
    return 1;
}

int joint_goes_on(const struct program_segment *a, const struct program_segment *b)
{
    return a->axis_count == PROGRAM_PLANE ? same_direction_in_plane(a, b)
                                          : same_direction_in_space(a, b) && same_slopes(a, b);
}
