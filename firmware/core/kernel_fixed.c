/* SPDX-License-Identifier: MIT */
/* Implements core/kernel_fixed.h (see there): the fixed kernel: integers only, the same bits everywhere. Used by
 * core/coefficients; called through struct kernel (core/kernel.h). Pure; the functions named *_set in the main loop,
 * the others in the tick. */
#include "core/kernel_fixed.h"

#include "core/kernel.h"
#include "core/qmath.h"

#define STEPS 2 /* of Newton's method */

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

static void set_inverses(struct kernel_fixed_arc *k, const struct ph_segment *ph)
{
    int64_t end_q48[PH_AXES];
    ph_segment_end(ph, end_q48);
    int shift = -18 - ph->exponent;
    int32_t before = (int32_t)qmath_shift(ph->c_q48_mm[PH_S][0], shift);
    int32_t after = (int32_t)qmath_shift(end_q48[PH_S] - ph->c_q48_mm[PH_S][0], shift);
    int32_t sigma_q30[3];
    for (int i = 0; i < 3; i++) {
        sigma_q30[i] = (int32_t)qmath_shift(ph->sigma_q50_mm[i], shift - 2);
    }
    set_inverse(&k->inverse[0], before, sigma_q30[1], sigma_q30[0]);
    set_inverse(&k->inverse[1], after, sigma_q30[1], sigma_q30[2]);
}

static void set_arc(struct kernel_fixed_arc *k, const struct ph_segment *ph)
{
    const int n = ph->exponent;
    k->origin_q40_mm = ph->origin_q40_mm[PH_S];
    k->exponent = n;
    for (int i = 0; i < 6; i++) {
        const int64_t c = ph->c_q48_mm[PH_S][i];
        k->c_q48_mm[i] = c * (1 << i);
        k->s_q30[i] = (int32_t)qmath_shift(c, i - 18 - n);
        if (i > 0) {
            k->slope_q29[i - 1] = (int32_t)qmath_shift(i * c, i - 20 - n);
        }
    }
    set_inverses(k, ph);
}

static void set_axis(struct kernel_fixed_axis *k, const struct ph_segment *ph, int axis)
{
    k->origin_q40_mm = ph->origin_q40_mm[axis];
    for (int i = 0; i < 6; i++) {
        k->c_q48_mm[i] = ph->c_q48_mm[axis][i] * (1 << i);
    }
}

/* A component of the preimage, normalised. */
static void set_component(int32_t a_q28[3], const int64_t a_q44[3], int exponent)
{
    for (int i = 0; i < 3; i++) {
        a_q28[i] = (int32_t)qmath_shift(a_q44[i], i - 18 - exponent / 2);
    }
}

void kernel_fixed_segment_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_fixed_segment *k = segment;
    set_arc(&k->arc, ph);
    set_axis(&k->axes[0], ph, PH_X);
    set_axis(&k->axes[1], ph, PH_Y);
    set_component(k->u_q28, ph->a_q44[PROGRAM_U], ph->exponent);
    set_component(k->v_q28, ph->a_q44[PROGRAM_Q], ph->exponent);
}

/* z in q31 for a normalised arc length from the middle. */
KERNEL_INLINE int32_t first_guess(const struct kernel_fixed_arc *k, int32_t s_q30)
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
KERNEL_INLINE int32_t slope_reciprocal_q15(const struct kernel_fixed_arc *k, int32_t z)
{
    int32_t slope = k->slope_q29[4];
    for (int i = 3; i >= 0; i--) {
        slope = qmath_mul_hi(slope, z) + k->slope_q29[i];
    }
    return (int32_t)(0xFFFFFFFFu / (uint32_t)(slope >> 12));
}

KERNEL_INLINE int32_t newton_step(const struct kernel_fixed_arc *k, int32_t s_q30, int32_t z,
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

/* 1 / sigma in q27 from 1 / (sigma / 2) nearby, refined twice. */
KERNEL_INLINE int32_t sigma_reciprocal_q27(int32_t sigma_q30, int32_t reciprocal_q15)
{
    int32_t inverse_q27 = reciprocal_q15 * (1 << 11);
    for (int i = 0; i < 2; i++) {
        int32_t error_q25 = (1 << 25) - qmath_mul_hi(sigma_q30, inverse_q27);
        inverse_q27 += (int32_t)(qmath_product(inverse_q27, error_q25) >> 25);
    }
    return inverse_q27;
}

/* Unit tangent w^2 / |w|^2 at z. */
static void tangent(const struct kernel_fixed_segment *k, int32_t z, int32_t reciprocal_q15,
                    int32_t tangent_q25[PROGRAM_PLANE])
{
    int32_t u = quadratic(k->u_q28, z) * 8;
    int32_t v = quadratic(k->v_q28, z) * 8;
    int32_t uu = qmath_mul_hi(u, u);
    int32_t vv = qmath_mul_hi(v, v);
    int32_t inverse_q27 = sigma_reciprocal_q27(uu + vv, reciprocal_q15);
    tangent_q25[0] = qmath_mul_hi(uu - vv, inverse_q27);
    tangent_q25[1] = qmath_mul_hi(2 * qmath_mul_hi(u, v), inverse_q27);
}

/* The place of an arc length on its segment. */
struct place {
    int32_t z_q31;
    int64_t remainder_q48_mm; /* the remainder of the arc length there, */
    int32_t remainder_q44_mm; /* and the same in a word */
    int32_t reciprocal_q15;   /* 1 / (sigma / 2) nearby, normalised */
};

KERNEL_INLINE struct place find(const struct kernel_fixed_arc *k, int64_t arc_length_q40_mm)
{
    struct place place = {0, 0, 0, 0};
    int64_t s_q48 = (arc_length_q40_mm - k->origin_q40_mm) * 256;
    int64_t from_middle = s_q48 - k->c_q48_mm[0];
    int32_t s_q30 = qmath_clamp32(qmath_shift(from_middle, -18 - k->exponent));
    int32_t z = first_guess(k, s_q30);
    for (int i = 0; i < STEPS; i++) {
        place.reciprocal_q15 = slope_reciprocal_q15(k, z);
        z = newton_step(k, s_q30, z, place.reciprocal_q15);
    }
    place.z_q31 = z;
    place.remainder_q48_mm = s_q48 - horner(k->c_q48_mm, z);
    place.remainder_q44_mm = qmath_clamp32(place.remainder_q48_mm >> 4);
    return place;
}

KERNEL_INLINE int64_t coordinate_q40(const struct kernel_fixed_axis *k, const struct place *place,
                                     int32_t tangent_q25)
{
    int64_t along = qmath_product(place->remainder_q44_mm, tangent_q25) >> 21;
    int64_t local = horner(k->c_q48_mm, place->z_q31) + along;
    return k->origin_q40_mm + qmath_round(local, 8);
}

void kernel_fixed_segment_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_fixed_segment *k = segment;
    const struct place place = find(&k->arc, arc_length_q40_mm);
    int32_t tangent_q25[PROGRAM_PLANE];
    tangent(k, place.z_q31, place.reciprocal_q15, tangent_q25);
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        position_q40[axis] = coordinate_q40(&k->axes[axis], &place, tangent_q25[axis]);
    }
}

void kernel_fixed_space_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_fixed_space *k = segment;
    set_arc(&k->arc, ph);
    for (int axis = 0; axis < (int)PROGRAM_SPACE; axis++) {
        set_axis(&k->axes[axis], ph, PH_X + axis);
    }
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
        set_component(k->a_q28[component], ph->a_q44[component], ph->exponent);
    }
    k->reserved = 0;
    k->extras = program_extra_axes(ph->axis_count);
    for (uint32_t i = 0; i < k->extras; i++) {
        extra_axis_set(&k->extra[i], &ph->extra[i]);
    }
}

/* Unit tangent A i A* / |A|^2 at z. */
static void tangent_in_space(const struct kernel_fixed_space *k, int32_t z, int32_t reciprocal_q15,
                             int32_t tangent_q25[PROGRAM_SPACE])
{
    int32_t u = quadratic(k->a_q28[PROGRAM_U], z) * 8;
    int32_t v = quadratic(k->a_q28[PROGRAM_V], z) * 8;
    int32_t p = quadratic(k->a_q28[PROGRAM_P], z) * 8;
    int32_t q = quadratic(k->a_q28[PROGRAM_Q], z) * 8;
    int32_t uv = qmath_mul_hi(u, u) + qmath_mul_hi(v, v);
    int32_t pq = qmath_mul_hi(p, p) + qmath_mul_hi(q, q);
    int32_t inverse_q27 = sigma_reciprocal_q27(uv + pq, reciprocal_q15);
    int32_t y = 2 * (qmath_mul_hi(u, q) + qmath_mul_hi(v, p));
    int32_t z_q30 = 2 * (qmath_mul_hi(v, q) - qmath_mul_hi(u, p));
    tangent_q25[0] = qmath_mul_hi(uv - pq, inverse_q27);
    tangent_q25[1] = qmath_mul_hi(y, inverse_q27);
    tangent_q25[2] = qmath_mul_hi(z_q30, inverse_q27);
}

/* The remainder of the arc length, as a difference in z. */
static int32_t remainder_in_z_q44(const struct kernel_fixed_arc *k, const struct place *place)
{
    int32_t remainder_q44 = qmath_clamp32(qmath_shift(place->remainder_q48_mm, -4 - k->exponent));
    return qmath_clamp32(qmath_product(remainder_q44, place->reciprocal_q15) >> 15);
}

/* A function of its own, so that a tick without extra axes does not contain its code. */
static KERNEL_APART void extras_at(const struct kernel_fixed_space *k, int64_t position_q40[],
                                   int32_t z_q31, int32_t dz_q44)
{
    for (uint32_t i = 0; i < k->extras; i++) {
        position_q40[PROGRAM_SPACE + i] = extra_axis_at_q40(&k->extra[i], z_q31, dz_q44);
    }
}

void kernel_fixed_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_fixed_space *k = segment;
    const struct place place = find(&k->arc, arc_length_q40_mm);
    int32_t tangent_q25[PROGRAM_SPACE];
    tangent_in_space(k, place.z_q31, place.reciprocal_q15, tangent_q25);
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        position_q40[axis] = coordinate_q40(&k->axes[axis], &place, tangent_q25[axis]);
    }
    if (k->extras != 0) {
        extras_at(k, position_q40, place.z_q31, remainder_in_z_q44(&k->arc, &place));
    }
}

const struct kernel kernel_fixed = {
    .piece_size = sizeof(struct feed_piece),
    .piece_set = feed_piece_set,
    .piece_at = feed_piece_at,
    .piece_acceleration = feed_piece_acceleration,
    .plane = {.segment_size = sizeof(struct kernel_fixed_segment),
              .segment_set = kernel_fixed_segment_set,
              .segment_at = kernel_fixed_segment_at},
    .space = {.segment_size = offsetof(struct kernel_fixed_space, extra),
              .extra_size = sizeof(struct extra_axis),
              .segment_set = kernel_fixed_space_set,
              .segment_at = kernel_fixed_space_at},
};
