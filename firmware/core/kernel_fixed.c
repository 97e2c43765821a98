/* SPDX-License-Identifier: MIT */
#include "core/kernel_fixed.h"

#include "core/kernel.h"
#include "core/qmath.h"

#define STEPS 2

/* 2^16 / a for a in q30, 2^-4 <= a < 1, in q16: twelve bits or more are right. */
static uint32_t reciprocal_q16(int32_t a_q30)
{
    return 0xFFFFFFFFu / (uint32_t)(a_q30 >> 14);
}

/* Cubic with z(0) = 0, z(1) = 1 and the slopes of the inverse of s(z); numerics.md section 12. */
static void set_inverse(struct kernel_fixed_inverse *inverse, int32_t half_q30,
                        int32_t sigma_middle_q30, int32_t sigma_end_q30)
{
    const int32_t one_q26 = 1 << 26;
    int64_t half = half_q30;
    int32_t first = (int32_t)((half * (int64_t)reciprocal_q16(sigma_middle_q30)) >> 19);
    int32_t last = (int32_t)((half * (int64_t)reciprocal_q16(sigma_end_q30)) >> 19);
    inverse->scale_q26 = (int32_t)(reciprocal_q16(half_q30) << 10);
    inverse->g_q26[0] = 2 * first;
    inverse->g_q26[1] = 4 * (3 * one_q26 - 2 * first - last);
    inverse->g_q26[2] = 8 * (first + last - 2 * one_q26);
}

static void set_inverses(struct kernel_fixed_segment *k, const struct ph_segment *ph)
{
    int64_t end_q48[3];
    ph_segment_end(ph, end_q48);
    int shift = -18 - ph->exponent;
    int32_t before = (int32_t)qmath_shift(ph->c_q48_mm[PH_S][0], shift);
    int32_t behind = (int32_t)qmath_shift(end_q48[PH_S] - ph->c_q48_mm[PH_S][0], shift);
    int32_t sigma_q30[3];
    for (int i = 0; i < 3; i++) {
        sigma_q30[i] = (int32_t)qmath_shift(ph->sigma_q50_mm[i], shift - 2);
    }
    set_inverse(&k->inverse[0], before, sigma_q30[1], sigma_q30[0]);
    set_inverse(&k->inverse[1], behind, sigma_q30[1], sigma_q30[2]);
}

void kernel_fixed_segment_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_fixed_segment *k = segment;
    int n = ph->exponent;
    for (int axis = PH_X; axis <= PH_S; axis++) {
        k->origin_q40_mm[axis] = ph->origin_q40_mm[axis];
        for (int i = 0; i < 6; i++) {
            k->c_q48_mm[axis][i] = ph->c_q48_mm[axis][i] * (1 << i);
        }
    }
    for (int i = 1; i < 6; i++) {
        int64_t c = ph->c_q48_mm[PH_S][i];
        k->s_q30[i] = (int32_t)qmath_shift(c, i - 18 - n);
        k->slope_q29[i - 1] = (int32_t)qmath_shift(i * c, i - 20 - n);
    }
    for (int i = 0; i < 3; i++) {
        k->u_q28[i] = (int32_t)qmath_shift(ph->u_q44[i], i - 18 - n / 2);
        k->v_q28[i] = (int32_t)qmath_shift(ph->v_q44[i], i - 18 - n / 2);
    }
    k->exponent = n;
    set_inverses(k, ph);
}

/* z in q31 for a normalised arc length from the middle. */
static int32_t first_guess(const struct kernel_fixed_segment *k, int32_t s_q30)
{
    const struct kernel_fixed_inverse *inverse = &k->inverse[s_q30 < 0 ? 0 : 1];
    int32_t t_q30 = s_q30 < 0 ? -(s_q30 + 1) : s_q30;
    t_q30 = t_q30 < 0x3FFFFFFF ? t_q30 : 0x3FFFFFFF;
    int32_t t_q25 = qmath_mul_hi(t_q30 * 2, inverse->scale_q26);
    int32_t t = t_q25 < 0x1FFFFFF ? t_q25 * 64 : INT32_MAX;
    int32_t z_q26 = qmath_mul_hi(inverse->g_q26[2], t) + inverse->g_q26[1];
    z_q26 = qmath_mul_hi(z_q26, t) + inverse->g_q26[0];
    int32_t z = qmath_clamp32((int64_t)qmath_mul_hi(z_q26, t) * 32);
    return s_q30 < 0 ? -z : z;
}

/* 1 / (sigma / 2) at z in q15, from 13 bits of it. */
static int32_t slope_reciprocal_q15(const struct kernel_fixed_segment *k, int32_t z)
{
    int32_t slope = k->slope_q29[4];
    for (int i = 3; i >= 0; i--) {
        slope = qmath_mul_hi(slope, z) + k->slope_q29[i];
    }
    return (int32_t)(0xFFFFFFFFu / (uint32_t)(slope >> 12));
}

static int32_t newton_step(const struct kernel_fixed_segment *k, int32_t s_q30, int32_t z,
                           int32_t reciprocal_q15)
{
    int32_t value = k->s_q30[5];
    for (int i = 4; i >= 1; i--) {
        value = qmath_mul_hi(value, z) + k->s_q30[i];
    }
    value = qmath_mul_hi(value, z) - s_q30;
    return qmath_clamp32(z - (qmath_product(value, reciprocal_q15) >> 14));
}

static int64_t horner(const int64_t c_q48[6], int32_t z)
{
    int64_t value = c_q48[5];
    for (int i = 4; i >= 0; i--) {
        value = qmath_mul_wide(value, z) + c_q48[i];
    }
    return value;
}

static int32_t quadratic(const int32_t c[3], int32_t z)
{
    return qmath_mul_hi(qmath_mul_hi(c[2], z) + c[1], z) + c[0];
}

/* Unit tangent w^2 / |w|^2 at z; the reciprocal of sigma nearby is refined twice. */
static void tangent(const struct kernel_fixed_segment *k, int32_t z, int32_t reciprocal_q15,
                    int32_t tangent_q25[2])
{
    int32_t u = quadratic(k->u_q28, z) * 8;
    int32_t v = quadratic(k->v_q28, z) * 8;
    int32_t uu = qmath_mul_hi(u, u);
    int32_t vv = qmath_mul_hi(v, v);
    int32_t inverse_q27 = reciprocal_q15 * (1 << 11);
    for (int i = 0; i < 2; i++) {
        int32_t error_q25 = (1 << 25) - qmath_mul_hi(uu + vv, inverse_q27);
        inverse_q27 += (int32_t)(qmath_product(inverse_q27, error_q25) >> 25);
    }
    tangent_q25[PH_X] = qmath_mul_hi(uu - vv, inverse_q27);
    tangent_q25[PH_Y] = qmath_mul_hi(2 * qmath_mul_hi(u, v), inverse_q27);
}

void kernel_fixed_segment_at(const void *segment, int64_t point_q40_mm[2],
                             int64_t arc_length_q40_mm)
{
    const struct kernel_fixed_segment *k = segment;
    int64_t s_q48 = (arc_length_q40_mm - k->origin_q40_mm[PH_S]) * 256;
    int64_t from_middle = s_q48 - k->c_q48_mm[PH_S][0];
    int32_t s_q30 = qmath_clamp32(qmath_shift(from_middle, -18 - k->exponent));
    int32_t z = first_guess(k, s_q30);
    int32_t reciprocal = 0;
    for (int i = 0; i < STEPS; i++) {
        reciprocal = slope_reciprocal_q15(k, z);
        z = newton_step(k, s_q30, z, reciprocal);
    }
    int32_t tangent_q25[2];
    tangent(k, z, reciprocal, tangent_q25);
    int32_t rest_q44 = qmath_clamp32((s_q48 - horner(k->c_q48_mm[PH_S], z)) >> 4);
    for (int axis = PH_X; axis <= PH_Y; axis++) {
        int64_t along = qmath_product(rest_q44, tangent_q25[axis]) >> 21;
        int64_t local = horner(k->c_q48_mm[axis], z) + along;
        point_q40_mm[axis] = k->origin_q40_mm[axis] + qmath_round(local, 8);
    }
}

const struct kernel kernel_fixed = {
    .piece_size = sizeof(struct feed_piece),
    .segment_size = sizeof(struct kernel_fixed_segment),
    .piece_set = feed_piece_set,
    .segment_set = kernel_fixed_segment_set,
    .piece_at = feed_piece_at,
    .piece_acceleration = feed_piece_acceleration,
    .segment_at = kernel_fixed_segment_at,
};
