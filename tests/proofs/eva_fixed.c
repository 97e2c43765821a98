/* SPDX-License-Identifier: MIT */
/*
 * The fixed kernel on any segment that passes the checks, at any arc length on it or 2^-33 mm outside: nothing
 * overflows, no conversion changes a number, no division by 0. A segment is given by the power of four above its sigma,
 * of which all 22 are gone through, and the least Bernstein coefficient, in seven ranges; the greatest is at most twice
 * that. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches
 * nothing.
 *
 * prover: eva
 * options: -eva-slevel 20 -warn-signed-downcast
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/qmath.h: (int64_t)((uint64_t)a << (shift & 63)) => a * ((int64_t)1 << shift)
 * instead: core/qmath.h: int32_t low = (int32_t)a; => if (1) return a < INT32_MIN ? INT32_MIN : a > INT32_MAX ? INT32_MAX : (int32_t)a; int32_t low = 0;
 * instead: core/kernel_fixed.c: end_q48[PH_S] - ph->c_q48_mm[PH_S][0] => behind_q48
 * instead: core/kernel_fixed.c: s_q48 - k->c_q48_mm[0] => from_middle_q48
 * instead: core/kernel_fixed.c: (1 << 25) - qmath_mul_hi(sigma_q30, inverse_q27) => small((1 << 25) - qmath_mul_hi(sigma_q30, inverse_q27))
 * instead: core/kernel_fixed.c: value = qmath_mul_hi(value, z) - s_q30 => value = half(qmath_mul_hi(value, z), z) - s_q30
 * assumes: slope_reciprocal_q15 quadratic first_guess qmath_third qmath_fifth
 * mutant: core/kernel_fixed.c: qmath_shift(i * c, i - 20 - n) => qmath_shift(i * c, i - 18 - n)
 * mutant: core/kernel_fixed.c: quadratic(k->v_q28, z) * 8 => quadratic(k->v_q28, z) * 16
 * mutant: core/kernel_fixed.c: reciprocal_q15 * (1 << 11) => reciprocal_q15 * (1 << 13)
 * mutant: core/kernel_fixed.c: qmath_clamp32(place.remainder_q48_mm >> 4) => (place.remainder_q48_mm >> 4)
 * mutant: core/kernel_fixed.c: (uint32_t)(a_q30 >> 14) => (uint32_t)(a_q30 >> 28)
 */
#include "kernel_bounds.h"
#include "proof.h"
#include "thirds_contract.h"

#include "core/kernel_fixed.h"

/*@ assigns \result \from *k, z;
    ensures RECIPROCAL_LEAST_Q15 <= \result <= RECIPROCAL_MOST_Q15; */
static int32_t slope_reciprocal_q15(const struct kernel_fixed_arc *k, int32_t z);

/*@ requires \initialized(c + (0 .. 2));
    assigns \result \from c[0 .. 2], z;
    ensures -W_BELOW_Q28 < \result < W_BELOW_Q28; */
static int32_t quadratic(const int32_t c[3], int32_t z);

/* eva_guess.c */
/*@ assigns \result \from *k, s_q30;
    behavior far_before: assumes s_q30 < -FAR_Q30; ensures -0x7FFFFFFF <= \result <= -FAR_Z_Q31;
    behavior before: assumes -FAR_Q30 <= s_q30 < 0; ensures -0x7FFFFFFF <= \result <= 0;
    behavior behind: assumes 0 <= s_q30 <= FAR_Q30; ensures 0 <= \result;
    behavior far_behind: assumes FAR_Q30 < s_q30; ensures FAR_Z_Q31 <= \result;
    complete behaviors; disjoint behaviors; */
static int32_t first_guess(const struct kernel_fixed_arc *k, int32_t s_q30);

static int64_t behind_q48;
static int64_t from_middle_q48;

static int32_t small(int32_t error_q25)
{
    (void)error_q25;
    return (int32_t)any_between(1 - ERROR_BELOW_Q25, ERROR_BELOW_Q25 - 1);
}

static int32_t half(int32_t value_q30, int32_t z)
{
    (void)value_q30;
    if (z >= 0) {
        return (int32_t)any_between(z >= FAR_Z_Q31 ? 1 : 0, HALF_MOST_Q30);
    }
    return (int32_t)any_between(-HALF_MOST_Q30, z <= -FAR_Z_Q31 ? -1 : 0);
}

#include "core/ph_segment.c"
#include "core/qmath.c"
#include "core/kernel_fixed.c"

/* What the reciprocal is taken of: the sums stay in range. */
static void add_up_slope(const struct kernel_fixed_arc *k, int32_t z)
{
    int32_t slope = k->slope_q29[4];
    for (int i = 3; i >= 0; i--) {
        slope = qmath_mul_hi(slope, z) + k->slope_q29[i];
    }
}

static void at(const struct kernel_fixed_segment *k, int64_t from, int64_t to)
{
    int64_t point[2];
    from_middle_q48 = any_between(from, to);
    kernel_fixed_segment_at(k, point, any_between(-POWER(7), POWER(45) + POWER(7)));
}

/* In the segment and outside: up to a normalised arc length of 1.25, and beyond, which only the shortest segments know. */
static void evaluate(const struct ph_segment *ph, int64_t most_q48)
{
    struct kernel_fixed_segment k;
    int64_t far = 5 * POWER(48 + ph->exponent) / 4;
    int64_t outside = most_q48 + POWER(15);
    kernel_fixed_segment_set(&k, ph);
    add_up_slope(&k.arc, (int32_t)any_between(INT32_MIN, INT32_MAX));
    if (outside <= far) {
        at(&k, -outside, outside);
        return;
    }
    at(&k, -far, far);
    at(&k, far, outside);
    at(&k, -outside, -far);
}

static void set_origin(struct ph_segment *ph)
{
    ph->origin_q40_mm[PH_X] = any_between(-POWER(52), POWER(52));
    ph->origin_q40_mm[PH_Y] = any_between(-POWER(52), POWER(52));
    ph->origin_q40_mm[PH_S] = 0;
    ph->axis_count = PROGRAM_PLANE;
}

/* Bernstein coefficients of sigma in [least, most], those of x and y as |w0|^2, |w2|^2 <= most and |w1|^2 <= 2 most say. */
static void expand(struct ph_segment *ph, int64_t least, int64_t most)
{
    int64_t e[5][PH_AXES];
    for (int k = 0; k < 5; k++) {
        int64_t times = k == 2 ? 3 : 1;
        int64_t across = k == 2 ? 5 * most : k == 1 || k == 3 ? most / 2 * 3 : most;
        e[k][PH_S] = any_between(times * least, times * most);
        e[k][PH_X] = any_between(-across, across);
        e[k][PH_Y] = any_between(-across, across);
    }
    for (int axis = PH_S; axis <= PH_Y; axis++) {
        centre(e, axis, ph->c_q48_mm[axis]);
    }
    ph->c_q48_mm[PH_S][0] = any_between(least / 8 - 16, most / 8 + 16);
    behind_q48 = any_between(least / 8 - 16, most / 8 + 16);
    ph->sigma_q50_mm[0] = e[0][PH_S];
    ph->sigma_q50_mm[1] = ph->c_q48_mm[PH_S][1] * 8;
    ph->sigma_q50_mm[2] = e[4][PH_S];
}

static void segment(int exponent, int64_t from, int64_t to)
{
    struct ph_segment ph;
    int64_t unit = POWER(50 + exponent);
    int64_t most = 2 * to > 64 ? unit : unit / 32 * to;
    int64_t w = POWER(44 + exponent / 2);
    set_origin(&ph);
    expand(&ph, unit / 64 * from - 32, most);
    for (int k = 0; k < 3; k++) {
        ph.a_q44[PROGRAM_U][k] = any_between(-5 * w, 5 * w);
        ph.a_q44[PROGRAM_Q][k] = any_between(-5 * w, 5 * w);
    }
    ph.exponent = exponent;
    evaluate(&ph, most / 8 + 16);
}

static void segments(int exponent)
{
    segment(exponent, 8, 10);
    segment(exponent, 10, 13);
    segment(exponent, 13, 17);
    segment(exponent, 17, 22);
    segment(exponent, 22, 32);
    segment(exponent, 32, 45);
    segment(exponent, 45, 64);
}

int main(void)
{
    //@ loop unroll 30;
    for (int exponent = PH_LEAST_EXPONENT; exponent <= 6; exponent += 2) {
        segments(exponent);
    }
    segment(8, 8, 8); /* sigma is 64 mm at most */
    reached();
    return 0;
}
