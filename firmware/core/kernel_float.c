/* SPDX-License-Identifier: MIT */
/* Implements core/kernel_float.h (see there): the float kernel: single precision and integers. Used by
 * core/coefficients; called through struct kernel (core/kernel.h). Pure; the functions named *_set in the main loop,
 * the others in the tick. */
#include "core/kernel_float.h"

#include "core/kernel.h"
#include "core/qmath.h"

#define Q30  1073741824.0f /* 2^30 */
#define Q24  16777216.0f   /* 2^24 */
#define HALF 2             /* parts on each side of the middle */

static float from_q30(int64_t a)
{
    return (float)(int32_t)a / Q30;
}

static float arc_at(const float s[6], float z)
{
    return ((((s[5] * z + s[4]) * z + s[3]) * z + s[2]) * z + s[1]) * z;
}

static float slope_at(const float s[6], float z)
{
    return (((5.0f * s[5] * z + 4.0f * s[4]) * z + 3.0f * s[3]) * z + 2.0f * s[2]) * z + s[1];
}

/* Cubic with the values and slopes of the inverse of s(z) at both ends; numerics.md section 12. */
static void set_inverse(struct kernel_float_inverse *inverse, const float s[6], float z0, float z1)
{
    float low = arc_at(s, z0);
    float distance = arc_at(s, z1) - low;
    float first = distance / slope_at(s, z0);
    float last = distance / slope_at(s, z1);
    inverse->s0 = low;
    inverse->scale = 1.0f / distance;
    inverse->z0 = z0;
    inverse->g[0] = first;
    inverse->g[1] = 3.0f * (z1 - z0) - 2.0f * first - last;
    inverse->g[2] = first + last - 2.0f * (z1 - z0);
}

static void set_inverses(struct kernel_float_arc *k)
{
    for (int i = 0; i < KERNEL_FLOAT_PARTS; i++) {
        float z0 = (float)(i - HALF) / (float)HALF;
        set_inverse(&k->inverse[i], k->s, z0, z0 + 1.0f / (float)HALF);
    }
}

/* By how much polynomials in q48 are shifted down: the bits beyond 31 that the sums of all powers but the linear one
 * need. */
static int shift_of(const struct ph_segment *ph)
{
    int64_t most = (int64_t)1 << 31; /* the remainder of the linear one is below it */
    for (int axis = PH_S; axis <= ph_last_axis(ph->axis_count); axis++) {
        int64_t sum = (int64_t)1 << 31;
        for (int i = 2; i < 6; i++) {
            sum += qmath_magnitude(ph->c_q48_mm[axis][i]);
        }
        most = sum > most ? sum : most;
    }
    const int bits = 64 - qmath_clz64((uint64_t)most);
    return bits - 31 > 1 ? bits - 31 : 1;
}

static void set_polynomial(struct kernel_float_polynomial *p, const int64_t c_q48[6], int shift)
{
    p->linear_q17_mm = (int32_t)(c_q48[1] >> 31);
    p->c[0] =
        (int32_t)qmath_round(c_q48[1] - (int64_t)p->linear_q17_mm * ((int64_t)1 << 31), shift);
    for (int i = 1; i < 5; i++) {
        p->c[i] = (int32_t)qmath_round(c_q48[i + 1], shift);
    }
}

static void kernel_float_set_arc(struct kernel_float_arc *k, const struct ph_segment *ph, int shift)
{
    const int n = ph->exponent;
    k->scale = (int32_t)1 << shift;
    k->shift = 18 + n;
    set_polynomial(&k->p, ph->c_q48_mm[PH_S], shift);
    k->middle_q40_mm = ph->origin_q40_mm[PH_S] + (ph->c_q48_mm[PH_S][0] >> 8);
    k->middle_remainder_q48 = (int32_t)(ph->c_q48_mm[PH_S][0] & 255);
    for (int i = 0; i < 6; i++) {
        k->s[i] = from_q30(qmath_shift(ph->c_q48_mm[PH_S][i], -18 - n));
    }
    set_inverses(k);
}

static void set_axis(struct kernel_float_axis *k, const struct ph_segment *ph, int axis, int shift)
{
    set_polynomial(&k->p, ph->c_q48_mm[axis], shift);
    k->middle_q48_mm = ph->origin_q40_mm[axis] * 256 + ph->c_q48_mm[axis][0];
}

/* A component of the preimage, normalised. In powers of z it can reach 1.25, so a quarter of it fits q30. */
static void kernel_float_set_component(float a[3], const int64_t a_q44[3], int exponent)
{
    for (int i = 0; i < 3; i++) {
        a[i] = 4.0f * from_q30(qmath_shift(a_q44[i], -18 - exponent / 2));
    }
}

/* Of a segment below all resolution the preimage may be 0: the remaining motion is too. */
static void kernel_float_keep_from_zero(float u[3], const struct ph_segment *ph)
{
    if (ph->exponent == PH_LEAST_EXPONENT) {
        u[0] += 1.0f;
    }
}

void kernel_float_segment_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_float_segment *k = segment;
    const int shift = shift_of(ph);
    kernel_float_set_arc(&k->arc, ph, shift);
    set_axis(&k->axes[0], ph, PH_X, shift);
    set_axis(&k->axes[1], ph, PH_Y, shift);
    kernel_float_set_component(k->u, ph->a_q44[PROGRAM_U], ph->exponent);
    kernel_float_set_component(k->v, ph->a_q44[PROGRAM_Q], ph->exponent);
    kernel_float_keep_from_zero(k->u, ph);
}

KERNEL_INLINE float first_guess(const struct kernel_float_arc *k, float s)
{
    const struct kernel_float_inverse *part = &k->inverse[s < 0.0f ? 0 : HALF];
    part += s < part[1].s0 ? 0 : 1;
    float t = (s - part->s0) * part->scale;
    return part->z0 + t * (part->g[0] + t * (part->g[1] + t * part->g[2]));
}

KERNEL_INLINE float newton_step(const float c[6], float s, float z)
{
    float value = c[5];
    float slope = value;
    for (int i = 4; i >= 1; i--) {
        value = value * z + c[i];
        slope = slope * z + value;
    }
    return z - (value * z - s) / slope;
}

/* To 2^-24, always below 1; in q31. */
KERNEL_INLINE int32_t quantise(float z)
{
    float limit = (Q24 - 1.0f) / Q24;
    z = z > limit ? limit : z;
    z = z < -1.0f ? -1.0f : z;
    return (int32_t)(z * Q24) * 128;
}

/* One coordinate from the middle, in q48. */
static int64_t polynomial(const struct kernel_float_polynomial *p, int32_t scale, int32_t z_q31)
{
    int32_t value = p->c[4];
    for (int i = 3; i >= 0; i--) {
        value = 2 * qmath_mul_hi(value, z_q31) + p->c[i];
    }
    value = 2 * qmath_mul_hi(value, z_q31);
    return qmath_product(value, scale) + qmath_product(p->linear_q17_mm, z_q31);
}

/* `remainder` (of the arc length) times the unit tangent w^2 / |w|^2. */
static void move_along(const struct kernel_float_segment *k, float z, float remainder,
                       float move[PROGRAM_PLANE])
{
    float u = k->u[0] + z * (k->u[1] + z * k->u[2]);
    float v = k->v[0] + z * (k->v[1] + z * k->v[2]);
    float uu = u * u;
    float vv = v * v;
    float sigma = uu + vv;
    float scale = remainder / sigma;
    move[0] = (uu - vv) * scale;
    move[1] = 2.0f * u * v * scale;
}

/* The place of an arc length on its segment. */
struct place {
    float z;
    int32_t z_q31;         /* the same, rounded */
    int32_t remainder_q44; /* the remainder of the arc length there */
};

KERNEL_INLINE struct place find(const struct kernel_float_arc *k, int64_t arc_length_q40_mm)
{
    struct place place;
    int64_t s_q48 = (arc_length_q40_mm - k->middle_q40_mm) * 256 - k->middle_remainder_q48;
    float s = from_q30(k->shift > 0 ? s_q48 >> k->shift
                                    : qmath_clamp32(s_q48 * ((int64_t)1 << -k->shift)));
    place.z = newton_step(k->s, s, first_guess(k, s));
    place.z_q31 = quantise(place.z);
    place.remainder_q44 = qmath_clamp32((s_q48 - polynomial(&k->p, k->scale, place.z_q31)) >> 4);
    return place;
}

KERNEL_INLINE int64_t coordinate_q40(const struct kernel_float_axis *k, int32_t scale,
                                     int32_t z_q31, float move_q44)
{
    int64_t moved_q48 =
        k->middle_q48_mm + (int64_t)(int32_t)move_q44 * 16 + polynomial(&k->p, scale, z_q31);
    return qmath_round(moved_q48, 8);
}

void kernel_float_segment_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_float_segment *k = segment;
    const struct place place = find(&k->arc, arc_length_q40_mm);
    float move_q44[PROGRAM_PLANE];
    move_along(k, place.z, (float)place.remainder_q44, move_q44);
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        position_q40[axis] =
            coordinate_q40(&k->axes[axis], k->arc.scale, place.z_q31, move_q44[axis]);
    }
}

static float kernel_float_power_of_two(int n)
{
    float p = 1.0f;
    for (; n > 0; n--) {
        p *= 2.0f;
    }
    for (; n < 0; n++) {
        p *= 0.5f;
    }
    return p;
}

void kernel_float_space_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_float_space *k = segment;
    const int shift = shift_of(ph);
    kernel_float_set_arc(&k->arc, ph, shift);
    for (int axis = 0; axis < (int)PROGRAM_SPACE; axis++) {
        set_axis(&k->axes[axis], ph, PH_X + axis, shift);
    }
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
        kernel_float_set_component(k->a[component], ph->a_q44[component], ph->exponent);
    }
    kernel_float_keep_from_zero(k->a[PROGRAM_U], ph);
    k->dz_q44 = kernel_float_power_of_two(1 - ph->exponent);
    k->extras = program_extra_axes(ph->axis_count);
    for (uint32_t i = 0; i < k->extras; i++) {
        extra_axis_set(&k->extra[i], &ph->extra[i]);
    }
}

KERNEL_INLINE float quadratic(const float c[3], float z)
{
    return c[0] + z * (c[1] + z * c[2]);
}

/* `remainder` (of the arc length) times the unit tangent A i A* / |A|^2; returns remainder / |A|^2. */
static float move_in_space(const struct kernel_float_space *k, float z, float remainder,
                           float move[PROGRAM_SPACE])
{
    float u = quadratic(k->a[PROGRAM_U], z);
    float v = quadratic(k->a[PROGRAM_V], z);
    float p = quadratic(k->a[PROGRAM_P], z);
    float q = quadratic(k->a[PROGRAM_Q], z);
    float uv = u * u + v * v;
    float pq = p * p + q * q;
    float scale = remainder / (uv + pq);
    float twice = scale + scale;
    move[0] = (uv - pq) * scale;
    move[1] = (u * q + v * p) * twice;
    move[2] = (v * q - u * p) * twice;
    return scale;
}

/* To the nearest word below 2^31. */
KERNEL_INLINE int32_t word(float a)
{
    float limit = 2147483520.0f;
    a = a > limit ? limit : a;
    a = a < -limit ? -limit : a;
    return (int32_t)a;
}

/* A function of its own, so that a tick without extra axes does not contain its code. */
static KERNEL_APART void extras_at(const struct kernel_float_space *k, int64_t position_q40[],
                                   int32_t z_q31, int32_t dz_q44)
{
    for (uint32_t i = 0; i < k->extras; i++) {
        position_q40[PROGRAM_SPACE + i] = extra_axis_at_q40(&k->extra[i], z_q31, dz_q44);
    }
}

void kernel_float_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_float_space *k = segment;
    const struct place place = find(&k->arc, arc_length_q40_mm);
    float move_q44[PROGRAM_SPACE];
    float scale = move_in_space(k, place.z, (float)place.remainder_q44, move_q44);
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        position_q40[axis] =
            coordinate_q40(&k->axes[axis], k->arc.scale, place.z_q31, move_q44[axis]);
    }
    if (k->extras != 0) {
        extras_at(k, position_q40, place.z_q31, word(scale * k->dz_q44));
    }
}

const struct kernel kernel_float = {
    .piece_size = sizeof(struct feed_piece),
    .piece_set = feed_piece_set,
    .piece_at = feed_piece_at,
    .piece_acceleration = feed_piece_acceleration,
    .plane = {.segment_size = sizeof(struct kernel_float_segment),
              .segment_set = kernel_float_segment_set,
              .segment_at = kernel_float_segment_at},
    .space = {.segment_size = offsetof(struct kernel_float_space, extra),
              .extra_size = sizeof(struct extra_axis),
              .segment_set = kernel_float_space_set,
              .segment_at = kernel_float_space_at},
};
