/* SPDX-License-Identifier: MIT */
/*
 * What others run per tick, to compare with: second-order Taylor interpolation of a cubic B-spline at constant feed,
 *
 *     u += V T / |r'| - (V T)^2 (r' . r'') / (2 |r'|^4)
 *
 * with r, r' and r'' by de Boor's algorithm, in single precision. Not in the product. Words: FILE, which gets the
 * setpoints, i32 x and y in nm. The store holds a struct path, all float (the emulator puts it there). Reciprocals of
 * differences of knots are made beforehand, which is to the credit of the other side. Run on an emulated board by
 * tools/analysis/taylor.py. Reads the store, and writes FILE by semihosting.
 */
#include <math.h>
#include <stdint.h>

#include "port/semihost/semihost.h"

enum { DEGREE = 3, MOST_POINTS = 64, MOST_TICKS = 1 << 20, STATUS_USAGE = 2, STATUS_FILE = 5 };

struct path {
    float count;  /* of control points */
    float way_mm; /* of a tick: feed times period */
    float points_mm[MOST_POINTS][2];
};

extern const uint8_t startup_store_base[];

static struct {
    const struct path *path;
    float knots[MOST_POINTS + DEGREE + 1];
    float inverse[DEGREE + 1][MOST_POINTS + DEGREE + 1]; /* 1 / (t[i + r] - t[i]) */
    int count;
    int span; /* t[span] <= u < t[span + 1] */
    float u;
} curve;

/* 0, or -1 when there are too few or too many points. */
static int prepare(const struct path *path)
{
    curve.path = path;
    curve.count = (int)path->count;
    if (curve.count <= DEGREE || curve.count > MOST_POINTS) {
        return -1;
    }
    const int last = curve.count - DEGREE;
    for (int i = 0; i < curve.count + DEGREE + 1; i++) {
        const int knot = i < DEGREE ? 0 : i - DEGREE > last ? last : i - DEGREE;
        curve.knots[i] = (float)knot;
    }
    for (int r = 1; r <= DEGREE; r++) {
        for (int i = 0; i + r < curve.count + DEGREE + 1; i++) {
            const float width = curve.knots[i + r] - curve.knots[i];
            curve.inverse[r][i] = width > 0.0f ? 1.0f / width : 0.0f;
        }
    }
    curve.span = DEGREE;
    curve.u = 0.0f;
    return 0;
}

/* r, r' and r'' of both coordinates: a triangle of means whose last but one and last but two rows give the
 * derivatives. */
static void de_boor(float u, float r[2][3])
{
    const int k = curve.span;
    const float *at = curve.knots + k - DEGREE;
    float d[2][DEGREE + 1];
    for (int axis = 0; axis < 2; axis++) {
        for (int j = 0; j <= DEGREE; j++) {
            d[axis][j] = curve.path->points_mm[k - DEGREE + j][axis];
        }
    }
    for (int level = 1; level <= DEGREE; level++) {
        const float *inverse = curve.inverse[DEGREE + 1 - level] + k - DEGREE;
        for (int axis = 0; axis < 2 && level > 1; axis++) {
            const float last = (d[axis][3] - d[axis][2]) * inverse[3];
            if (level == DEGREE) {
                r[axis][1] = 3.0f * last;
            } else {
                const float before = (d[axis][2] - d[axis][1]) * inverse[2];
                r[axis][2] = 6.0f * (last - before) * curve.inverse[1][k];
            }
        }
        for (int j = DEGREE; j >= level; j--) {
            const float a = (u - at[j]) * inverse[j];
            d[0][j] = d[0][j - 1] + a * (d[0][j] - d[0][j - 1]);
            d[1][j] = d[1][j - 1] + a * (d[1][j] - d[1][j - 1]);
        }
    }
    r[0][0] = d[0][DEGREE];
    r[1][0] = d[1][DEGREE];
}

/* The counted part: two setpoints out, parameter moved on. 1 at the end of the curve. */
__attribute__((noinline)) static int tick(int32_t target_nm[2])
{
    const float end = curve.knots[curve.count];
    float r[2][3];
    const float u = curve.u < end ? curve.u : end;
    while (curve.span + 1 < curve.count && u >= curve.knots[curve.span + 1]) {
        curve.span++;
    }
    de_boor(u, r);
    const float *x = r[0];
    const float *y = r[1];
    const float way = curve.path->way_mm;
    const float squared = x[1] * x[1] + y[1] * y[1];
    const float along = x[1] * x[2] + y[1] * y[2];
    const float inverse = 1.0f / squared;
    const float first = way * sqrtf(squared) * inverse;
    const float step = way * inverse;
    curve.u = u + first - 0.5f * along * step * step;
    target_nm[0] = (int32_t)(x[0] * 1e6f);
    target_nm[1] = (int32_t)(y[0] * 1e6f);
    return u >= end;
}

int main(void)
{
    char name[384];
    int32_t target_nm[2];
    if (semihost_command_line(name, sizeof name) != 0) {
        return STATUS_USAGE;
    }
    const int file = semihost_open(name, SEMIHOST_WRITE);
    if (file < 0) {
        return STATUS_FILE;
    }
    if (prepare((const struct path *)(const void *)startup_store_base) != 0) {
        return STATUS_USAGE;
    }
    int over = 0;
    for (int k = 0; k < MOST_TICKS && over == 0; k++) {
        over = tick(target_nm);
        if (semihost_write(file, target_nm, sizeof target_nm) != 0) {
            return STATUS_FILE;
        }
    }
    return semihost_close(file) == 0 ? 0 : STATUS_FILE;
}
