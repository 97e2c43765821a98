/* SPDX-License-Identifier: MIT */
/* Implements core/feed_bounds.h (see there): feed, acceleration and jerk of a piece: values at its ends and bounds
 * over it. Used by the checks of a program. Pure, main loop. */
#include "core/feed_bounds.h"

#include <assert.h>

#include "core/bernstein.h"
#include "core/qmath.h"

/* The most by which rounding of powers of tau and of the coefficients' lower bits changes a Bernstein coefficient, in
 * q36: 4 bits dropped and 3 units a power, times the binomials, over the scale. */
#define COEFFICIENT_ROUNDING 64

/* tau at the end of the piece in q64; exactly 1 is 0. */
static uint64_t end_tau_q64(const struct program_piece *piece)
{
    int shift = 32 - program_piece_exponent(piece->duration_q32_s);
    return piece->duration_q32_s << (shift - 1) << 1; /* the shift can be 64 */
}

/* a tau, at most 3 units below */
static int64_t times_tau(int64_t a, uint64_t tau_q64)
{
    if (tau_q64 == 0) {
        return a;
    }
    return qmath_mul_unsigned(a, (uint32_t)(tau_q64 >> 32)) +
           (qmath_mul_unsigned(a, (uint32_t)tau_q64) >> 32);
}

/* Coefficients in tau of a derivative of F of order 0 ... 3, in the units of c; returns the degree.
 */
static int derive(const struct program_piece *piece, int order, int64_t a[8])
{
    assert(order >= 0 && order <= 3);
    for (int k = order; k <= 7; k++) {
        int64_t factor = 1;
        for (int i = 0; i < order; i++) {
            factor *= k - i;
        }
        a[k - order] = k == 0 ? 0 : factor * piece->c_q40_mm[k - 1];
    }
    return 7 - order;
}

static int64_t horner(const int64_t *a, int degree, uint64_t tau_q64)
{
    assert(degree >= 0);
    int64_t value = a[degree];
    for (int k = degree - 1; k >= 0; k--) {
        value = times_tau(value, tau_q64) + a[k];
    }
    return value;
}

void feed_bounds_start(const struct program_piece *piece, struct feed_state *out)
{
    int e = program_piece_exponent(piece->duration_q32_s);
    out->arc_length_q44_mm = 0;
    out->feed_q24_mm_s = qmath_shift_clamp(piece->c_q40_mm[0], -16 - e);
    out->acceleration_q16_mm_s2 = qmath_shift_clamp(2 * piece->c_q40_mm[1], -24 - 2 * e);
}

void feed_bounds_end(const struct program_piece *piece, struct feed_state *out)
{
    int e = program_piece_exponent(piece->duration_q32_s);
    uint64_t tau = end_tau_q64(piece);
    int64_t a[8] = {0};
    int degree = derive(piece, 0, a);
    for (int k = 0; k <= degree; k++) {
        a[k] *= 16;
    }
    out->arc_length_q44_mm = horner(a, degree, tau);
    degree = derive(piece, 1, a);
    for (int k = 0; k <= degree; k++) {
        a[k] *= 16;
    }
    out->feed_q24_mm_s = qmath_shift_clamp(horner(a, degree, tau), -20 - e);
    degree = derive(piece, 2, a);
    out->acceleration_q16_mm_s2 = qmath_shift_clamp(horner(a, degree, tau), -24 - 2 * e);
}

/* A bound in 2^-24 physical units as one of the scaled Bernstein coefficients in q36 and tau. */
static int64_t scaled_bound(int64_t bound_q24, int64_t scale, int order, int exponent)
{
    const int64_t most = FEED_NO_BOUND_Q24;
    bound_q24 = bound_q24 > most ? most : bound_q24 < -most ? -most : bound_q24;
    return qmath_shift_clamp(bound_q24 * scale, 12 + order * exponent);
}

/* Bernstein coefficients of a derivative of F on the whole piece, in q36; returns their scale and sets the degree. */
static int64_t bernstein_of(const struct program_piece *piece, int order, int64_t b[8], int *degree)
{
    uint64_t tau = end_tau_q64(piece);
    int64_t a[8] = {0};
    *degree = derive(piece, order, a);
    for (int k = 0; k <= *degree; k++) {
        /* power k of the end of the interval, so that it becomes [0, 1] */
        for (int i = 0; i < k; i++) {
            a[k] = times_tau(a[k], tau);
        }
        a[k] >>= 4;
    }
    return bernstein_from_powers(a, *degree, b);
}

int feed_bounds_contained(const struct program_piece *piece)
{
    int64_t b[8];
    int degree = 0;
    int64_t scale = bernstein_of(piece, 0, b, &degree);
    int64_t slack = scale * FEED_PIECE_SLACK_Q36;
    int64_t low = b[degree] < 0 ? b[degree] : 0;
    int64_t high = b[degree] < 0 ? 0 : b[degree];
    return bernstein_within(b, degree, low - slack, high + slack);
}

int feed_bounds_within(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24, int64_t high_q24)
{
    int order = (int)derivative;
    int e = program_piece_exponent(piece->duration_q32_s);
    int64_t b[8];
    int degree = 0;
    int64_t scale = bernstein_of(piece, order, b, &degree);
    return bernstein_within(b, degree, scaled_bound(low_q24, scale, order, e),
                            scaled_bound(high_q24, scale, order, e));
}

/* One of the scaled Bernstein coefficients (q36, tau) in 2^-24 physical units, not below; a unit more than rounding
 * takes. */
static int64_t unscaled_above(int64_t b, int64_t scale, int order, int exponent)
{
    int64_t size = (int64_t)qmath_div_u64((uint64_t)qmath_magnitude(b), (uint64_t)scale);
    int64_t above = (b < 0 ? -size : size + 1) + COEFFICIENT_ROUNDING;
    above = qmath_shift_clamp(above, -12 - order * exponent);
    return qmath_lesser(above + 1, FEED_NO_BOUND_Q24);
}

void feed_bounds_parts(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24[FEED_PARTS], int64_t high_q24[FEED_PARTS])
{
    int order = (int)derivative;
    int e = program_piece_exponent(piece->duration_q32_s);
    int64_t b[FEED_PARTS][8];
    int degree = 0;
    int64_t scale = bernstein_of(piece, order, b[0], &degree);
    for (int apart = FEED_PARTS / 2; apart > 0; apart /= 2) {
        for (int i = 0; i < FEED_PARTS; i += 2 * apart) {
            bernstein_halve(b[i], b[i + apart], degree);
        }
    }
    for (int i = 0; i < FEED_PARTS; i++) {
        int64_t low = b[i][0];
        int64_t high = b[i][0];
        for (int k = 1; k <= degree; k++) {
            low = qmath_lesser(low, b[i][k]);
            high = qmath_greater(high, b[i][k]);
        }
        high_q24[i] = qmath_greater(unscaled_above(high, scale, order, e), -FEED_NO_BOUND_Q24);
        low_q24[i] = qmath_greater(-unscaled_above(-low, scale, order, e), -FEED_NO_BOUND_Q24);
    }
}
