/* SPDX-License-Identifier: MIT */
#include "core/kernel_float.h"

#include "core/kernel.h"
#include "core/qmath.h"

#define Q30  1073741824.0f
#define Q24  16777216.0f
#define HALF 2 /* parts on each side of the middle */

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
    float way = arc_at(s, z1) - low;
    float first = way / slope_at(s, z0);
    float last = way / slope_at(s, z1);
    inverse->s0 = low;
    inverse->scale = 1.0f / way;
    inverse->z0 = z0;
    inverse->g[0] = first;
    inverse->g[1] = 3.0f * (z1 - z0) - 2.0f * first - last;
    inverse->g[2] = first + last - 2.0f * (z1 - z0);
}

static void set_inverses(struct kernel_float_segment *k)
{
    for (int i = 0; i < KERNEL_FLOAT_PARTS; i++) {
        float z0 = (float)(i - HALF) / (float)HALF;
        set_inverse(&k->inverse[i], k->s, z0, z0 + 1.0f / (float)HALF);
    }
}

/* Bits that the sums of all powers but the linear one need, in q48. */
static int bits_of(const struct ph_segment *ph)
{
    int64_t most = (int64_t)1 << 31; /* the linear one leaves less than that */
    for (int axis = PH_X; axis <= PH_S; axis++) {
        int64_t sum = (int64_t)1 << 31;
        for (int i = 2; i < 6; i++) {
            sum += qmath_magnitude(ph->c_q48_mm[axis][i]);
        }
        most = sum > most ? sum : most;
    }
    return 64 - qmath_clz64((uint64_t)most);
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

void kernel_float_segment_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_float_segment *k = segment;
    int n = ph->exponent;
    int shift = bits_of(ph) - 31 > 1 ? bits_of(ph) - 31 : 1;
    k->scale = (int32_t)1 << shift;
    k->shift = 18 + n;
    for (int axis = PH_X; axis <= PH_S; axis++) {
        set_polynomial(&k->p[axis], ph->c_q48_mm[axis], shift);
    }
    for (int axis = PH_X; axis <= PH_Y; axis++) {
        k->middle_q48_mm[axis] = ph->origin_q40_mm[axis] * 256 + ph->c_q48_mm[axis][0];
    }
    k->middle_arc_q40_mm = ph->origin_q40_mm[PH_S] + (ph->c_q48_mm[PH_S][0] >> 8);
    k->middle_rest_q48 = (int32_t)(ph->c_q48_mm[PH_S][0] & 255);
    for (int i = 0; i < 6; i++) {
        k->s[i] = from_q30(qmath_shift(ph->c_q48_mm[PH_S][i], -18 - n));
    }
    for (int i = 0; i < 3; i++) {
        /* w in powers of z can reach 1.25: a quarter of it fits q30 with room */
        k->u[i] = 4.0f * from_q30(qmath_shift(ph->u_q44[i], -18 - n / 2));
        k->v[i] = 4.0f * from_q30(qmath_shift(ph->v_q44[i], -18 - n / 2));
    }
    if (ph->exponent == PH_LEAST_EXPONENT) {
        k->u[0] +=
            1.0f; /* of a segment below all resolution w may be 0: what is left to move is too */
    }
    set_inverses(k);
}

static float first_guess(const struct kernel_float_segment *k, float s)
{
    const struct kernel_float_inverse *part = &k->inverse[s < 0.0f ? 0 : HALF];
    part += s < part[1].s0 ? 0 : 1;
    float t = (s - part->s0) * part->scale;
    return part->z0 + t * (part->g[0] + t * (part->g[1] + t * part->g[2]));
}

static float newton_step(const float c[6], float s, float z)
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
static int32_t quantise(float z)
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

/* rest times the unit tangent w^2 / |w|^2. */
static void move_along(const struct kernel_float_segment *k, float z, float rest, float move[2])
{
    float u = k->u[0] + z * (k->u[1] + z * k->u[2]);
    float v = k->v[0] + z * (k->v[1] + z * k->v[2]);
    float uu = u * u;
    float vv = v * v;
    float sigma = uu + vv;
    float scale = rest / sigma;
    move[PH_X] = (uu - vv) * scale;
    move[PH_Y] = 2.0f * u * v * scale;
}

void kernel_float_segment_at(const void *segment, int64_t point_q40_mm[2],
                             int64_t arc_length_q40_mm)
{
    const struct kernel_float_segment *k = segment;
    int64_t s_q48 = (arc_length_q40_mm - k->middle_arc_q40_mm) * 256 - k->middle_rest_q48;
    float s = from_q30(k->shift > 0 ? s_q48 >> k->shift
                                    : qmath_clamp32(s_q48 * ((int64_t)1 << -k->shift)));
    float z = newton_step(k->s, s, first_guess(k, s));
    int32_t z_q31 = quantise(z);
    int32_t rest_q44 = qmath_clamp32((s_q48 - polynomial(&k->p[PH_S], k->scale, z_q31)) >> 4);
    float move_q44[2];
    move_along(k, z, (float)rest_q44, move_q44);
    for (int axis = PH_X; axis <= PH_Y; axis++) {
        int64_t moved_q48 = k->middle_q48_mm[axis] + (int64_t)(int32_t)move_q44[axis] * 16 +
                            polynomial(&k->p[axis], k->scale, z_q31);
        point_q40_mm[axis] = qmath_round(moved_q48, 8);
    }
}

const struct kernel kernel_float = {
    .piece_size = sizeof(struct feed_piece),
    .segment_size = sizeof(struct kernel_float_segment),
    .piece_set = feed_piece_set,
    .segment_set = kernel_float_segment_set,
    .piece_at = feed_piece_at,
    .piece_acceleration = feed_piece_acceleration,
    .segment_at = kernel_float_segment_at,
};
