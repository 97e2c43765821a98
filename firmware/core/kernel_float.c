/* SPDX-License-Identifier: MIT */
#include "core/kernel_float.h"

#include "core/kernel.h"
#include "core/qmath.h"

#define STEPS 2
#define Q30   1073741824.0f
#define Q31   2147483648.0f
#define Q24   16777216.0f

static float from_q30(int64_t a)
{
    return (float)(int32_t)a / Q30;
}

/* Cubic with z(0) = 0, z(1) = 1 and the slopes of the inverse of s(z); numerics.md section 12. */
static void set_inverse(float g[4], float half, float sigma_middle, float sigma_end)
{
    float first = 2.0f * half / sigma_middle;
    float last = 2.0f * half / sigma_end;
    g[0] = 1.0f / half;
    g[1] = first;
    g[2] = 3.0f - 2.0f * first - last;
    g[3] = first + last - 2.0f;
}

static void set_inverses(struct kernel_float_segment *k, const struct ph_segment *ph)
{
    int64_t end_q48[3];
    ph_segment_end(ph, end_q48);
    int shift = -18 - ph->exponent;
    float before = from_q30(qmath_shift(ph->c_q48_mm[PH_S][0], shift));
    float behind = from_q30(qmath_shift(end_q48[PH_S] - ph->c_q48_mm[PH_S][0], shift));
    float sigma[3];
    for (int i = 0; i < 3; i++) {
        sigma[i] = from_q30(qmath_shift(ph->sigma_q50_mm[i], shift - 2));
    }
    set_inverse(k->inverse[0], before, sigma[1], sigma[0]);
    set_inverse(k->inverse[1], behind, sigma[1], sigma[2]);
}

void kernel_float_segment_set(struct kernel_float_segment *k, const struct ph_segment *ph)
{
    int n = ph->exponent;
    for (int axis = PH_X; axis <= PH_S; axis++) {
        k->origin_q40_mm[axis] = ph->origin_q40_mm[axis];
        for (int i = 0; i < 4; i++) {
            k->c_q48_mm[axis][i] = ph->c_q48_mm[axis][i] * (1 << i);
        }
        for (int i = 0; i < 2; i++) {
            k->high[axis][i] = from_q30(qmath_shift(ph->c_q48_mm[axis][i + 4], -18 - n));
        }
    }
    for (int i = 0; i < 6; i++) {
        k->s[i] = from_q30(qmath_shift(ph->c_q48_mm[PH_S][i], -18 - n));
    }
    for (int i = 0; i < 3; i++) {
        /* w in powers of z can reach 1.25: a quarter of it fits q30 with room */
        k->u[i] = 4.0f * from_q30(qmath_shift(ph->u_q44[i], -18 - n / 2));
        k->v[i] = 4.0f * from_q30(qmath_shift(ph->v_q44[i], -18 - n / 2));
    }
    k->exponent = n;
    set_inverses(k, ph);
}

static float first_guess(const struct kernel_float_segment *k, float s)
{
    const float *g = s < 0.0f ? k->inverse[0] : k->inverse[1];
    float sign = s < 0.0f ? -1.0f : 1.0f;
    float t = sign * s * g[0];
    t = t > 1.0f ? 1.0f : t;
    return sign * t * (g[1] + t * (g[2] + t * g[3]));
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

/* To 2^-24, where the float and the integer z are the same number; always below 1. */
static int32_t quantise_q24(float z)
{
    float limit = (Q24 - 1.0f) / Q24;
    z = z > limit ? limit : z;
    z = z < -1.0f ? -1.0f : z;
    return (int32_t)(z * Q24);
}

/* One coordinate in q48: low powers in integers, high ones in float. */
static int64_t polynomial(const struct kernel_float_segment *k, int axis, int32_t z_q31, float z)
{
    const int64_t *low = k->c_q48_mm[axis];
    const float *high = k->high[axis];
    int64_t value = qmath_mul_wide(low[3], z_q31) + low[2];
    value = qmath_mul_wide(qmath_mul_wide(value, z_q31) + low[1], z_q31) + low[0];
    float squared = z * z;
    float rest = squared * squared * (high[0] + z * high[1]);
    return value + qmath_shift((int32_t)(rest * Q31), 17 + k->exponent);
}

/* rest times the unit tangent w^2 / |w|^2. */
static void move_along(const struct kernel_float_segment *k, float z, float rest, float move[2])
{
    float u = k->u[0] + z * (k->u[1] + z * k->u[2]);
    float v = k->v[0] + z * (k->v[1] + z * k->v[2]);
    float uu = u * u;
    float vv = v * v;
    float sigma = uu + vv;
    float scale = sigma > 0.0f ? rest / sigma : 0.0f;
    move[PH_X] = (uu - vv) * scale;
    move[PH_Y] = 2.0f * u * v * scale;
}

void kernel_float_segment_at(const struct kernel_float_segment *k, int64_t arc_length_q40_mm,
                             int64_t point_q40_mm[2])
{
    int64_t s_q48 = (arc_length_q40_mm - k->origin_q40_mm[PH_S]) * 256;
    int64_t from_middle = s_q48 - k->c_q48_mm[PH_S][0];
    float s = from_q30(qmath_clamp32(qmath_shift(from_middle, -18 - k->exponent)));
    float z = first_guess(k, s);
    for (int i = 0; i < STEPS; i++) {
        z = newton_step(k->s, s, z);
    }
    int32_t z_q24 = quantise_q24(z);
    z = (float)z_q24 / Q24;
    int32_t rest_q44 = qmath_clamp32((s_q48 - polynomial(k, PH_S, z_q24 * 128, z)) >> 4);
    float move_q44[2];
    move_along(k, z, (float)rest_q44, move_q44);
    for (int axis = PH_X; axis <= PH_Y; axis++) {
        int64_t local = polynomial(k, axis, z_q24 * 128, z) + (int64_t)(int32_t)move_q44[axis] * 16;
        point_q40_mm[axis] = k->origin_q40_mm[axis] + qmath_round(local, 8);
    }
}

static void set_segment(void *segment, const struct ph_segment *from)
{
    kernel_float_segment_set(segment, from);
}

static void segment_at(const void *segment, int64_t arc_length_q40_mm, int64_t point_q40_mm[2])
{
    kernel_float_segment_at(segment, arc_length_q40_mm, point_q40_mm);
}

const struct kernel kernel_float = {
    .piece_size = sizeof(struct feed_piece),
    .segment_size = sizeof(struct kernel_float_segment),
    .piece_set = feed_piece_make,
    .segment_set = set_segment,
    .piece_at = feed_piece_point,
    .segment_at = segment_at,
};
