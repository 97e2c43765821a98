/* SPDX-License-Identifier: MIT */
/* Implements numerics/ph_chain.h (see there): places by arc length on a chain of Pythagorean-hodograph segments, and
 * derivatives there. Called by host_tools/hodograph/native. Writes the caller's arrays only; any thread. */
#include "numerics/ph_chain.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

enum { SPATIAL_AXES = 3, ARC_SIZE = 6, SPEED_SIZE = 5, MOST_STEPS = 200 };
static const double SAME_XI = 0x1p-53;

/* Derivatives of the parametric speed by xi. */
struct ph_speed {
    double sigma, growth, bend;
};

static double quartic(const double *c, double x)
{
    const double y = 1.0 - x, xx = x * x, yy = y * y;
    return c[0] * (yy * yy) + 4.0 * c[1] * (x * (yy * y)) + 6.0 * c[2] * (xx * yy) +
           4.0 * c[3] * (xx * x * y) + c[4] * (xx * xx);
}

static double quintic(const double *c, double x)
{
    const double y = 1.0 - x, xx = x * x, yy = y * y;
    return c[0] * (yy * yy * y) + 5.0 * c[1] * (x * (yy * yy)) + 10.0 * c[2] * (xx * (yy * y)) +
           10.0 * c[3] * (xx * x * yy) + 5.0 * c[4] * (xx * xx * y) + c[5] * (xx * xx * x);
}

/* The number of the last of joints 0 to N - 1 at or before an arc length. Searches first at the last place. */
static uint32_t segment_of(const struct ph_chain *chain, double arc_mm, uint32_t last)
{
    const double *start = chain->start;
    uint32_t low = 0, high = chain->segments;
    if (start[last] <= arc_mm) {
        low = last;
        high = last + 1 < chain->segments && start[last + 1] > arc_mm ? last + 1 : high;
    } else {
        high = last;
    }
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (start[middle] <= arc_mm) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Newton's method inside a bracket that shrinks in every step, so that it also ends where the speed is nearly 0. */
static double inverted(const double *arc, const double *speed, double arc_mm, double tolerance)
{
    const double length = arc[ARC_SIZE - 1];
    double x = arc_mm / length, low = 0.0, high = 1.0;
    if (!(x > 0.0 && x < 1.0)) {
        return x > 0.0 ? 1.0 : 0.0;
    }
    for (uint32_t step = 0; step < MOST_STEPS; step++) {
        const double excess = quintic(arc, x) - arc_mm;
        if (fabs(excess) <= tolerance * length) {
            break;
        }
        *(excess > 0.0 ? &high : &low) = x;
        const double newton = x - excess / quartic(speed, x);
        const double moved = newton > low && newton < high ? newton : (low + high) / 2.0;
        const bool same = fabs(moved - x) <= SAME_XI;
        x = moved;
        if (same) {
            break;
        }
    }
    return x;
}

void ph_locate(const struct ph_chain *chain, uint32_t count, const double *arc_mm, double tolerance,
               int64_t *segment, double *xi)
{
    uint32_t last = 0;
    for (uint32_t k = 0; k < count; k++) {
        last = segment_of(chain, arc_mm[k], last);
        segment[k] = last;
        xi[k] =
            inverted(chain->arc + (size_t)ARC_SIZE * last, chain->speed + (size_t)SPEED_SIZE * last,
                     arc_mm[k] - chain->start[last], tolerance);
    }
}

/* Where the derivatives of one place are stored. */
struct ph_frame {
    double *r1, *r2, *r3;
    size_t step; /* from one axis to the next */
};

static void frame_put(const struct ph_frame *to, uint32_t axis, double r1, double r2, double r3)
{
    to->r1[axis * to->step] = r1;
    to->r2[axis * to->step] = r2;
    to->r3[axis * to->step] = r3;
}

/* In the plane; returns the curvature. With the tangent t and the normal n, r_ss = k n and r_sss = k' n - k^2 t. */
static double planar_frame(const double *w, double xi, const struct ph_frame *to)
{
    const double y = 1.0 - xi, b0 = y * y, b1 = 2.0 * xi * y, b2 = xi * xi;
    double at[2], first[2], second[2];
    for (uint32_t k = 0; k < 2; k++) {
        const double w0 = w[k], w1 = w[2 + k], w2 = w[4 + k];
        at[k] = w0 * b0 + w1 * b1 + w2 * b2;
        first[k] = 2.0 * ((w1 - w0) * y + (w2 - w1) * xi);
        second[k] = 2.0 * (w2 - 2.0 * w1 + w0);
    }
    const double sigma = at[0] * at[0] + at[1] * at[1];
    const double turn = at[0] * first[1] - at[1] * first[0];
    const double growth = 2.0 * (at[0] * first[0] + at[1] * first[1]);
    const double again = at[0] * second[1] - at[1] * second[0];
    const double square = sigma * sigma, curvature = 2.0 * turn / square;
    const double slope = (2.0 * again / square - 4.0 * turn * growth / (square * sigma)) / sigma;
    const double tx = (at[0] * at[0] - at[1] * at[1]) / sigma, ty = 2.0 * at[0] * at[1] / sigma;
    const double bend = curvature * curvature;
    frame_put(to, 0, tx, -curvature * ty, -slope * ty - bend * tx);
    frame_put(to, 1, ty, curvature * tx, slope * tx - bend * ty);
    return curvature;
}

/* (a i b* + b i a*) / 2 */
static void image(const double *a, const double *b, double *out)
{
    out[0] = (a[0] * b[0] + a[1] * b[1]) - (a[2] * b[2] + a[3] * b[3]);
    out[1] = (a[0] * b[3] + a[3] * b[0]) + (a[1] * b[2] + a[2] * b[1]);
    out[2] = (a[1] * b[3] + a[3] * b[1]) - (a[0] * b[2] + a[2] * b[0]);
}

static double inner(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/* A and its derivatives by xi. */
struct ph_preimage {
    double at[4], first[4], second[4];
};

static struct ph_preimage preimage_at(const double *preimage, double xi)
{
    const double y = 1.0 - xi, b0 = y * y, b1 = 2.0 * xi * y, b2 = xi * xi;
    struct ph_preimage a;
    for (uint32_t k = 0; k < 4; k++) {
        const double *c = preimage + (size_t)3 * k;
        a.at[k] = c[0] * b0 + c[1] * b1 + c[2] * b2;
        a.first[k] = 2.0 * ((c[1] - c[0]) * y + (c[2] - c[1]) * xi);
        a.second[k] = 2.0 * (c[2] - 2.0 * c[1] + c[0]);
    }
    return a;
}

/* In space. sigma r_ss and sigma^2 r_sss follow from r' = sigma r_s by differentiation. Returns the curvature. */
static double spatial_frame(const struct ph_preimage *a, const struct ph_speed *speed,
                            const struct ph_frame *to)
{
    const double sigma = speed->sigma, square = sigma * sigma;
    double r[3], d[3], dd[3], again[3], bends = 0.0;
    image(a->at, a->at, r);
    image(a->at, a->first, d);
    image(a->first, a->first, dd);
    image(a->at, a->second, again);
    for (uint32_t axis = 0; axis < SPATIAL_AXES; axis++) {
        const double r1 = r[axis] / sigma;
        const double r2 = (2.0 * d[axis] - speed->growth * r1) / square;
        const double third = 2.0 * (dd[axis] + again[axis]) - speed->bend * r1;
        frame_put(to, axis, r1, r2, third / (square * sigma) - 3.0 * speed->growth / square * r2);
        bends += r2 * r2;
    }
    return sqrt(bends);
}

/* An extra axis, a quintic in xi. */
static void extra_frame(const double *c, double xi, const struct ph_speed *speed, uint32_t axis,
                        const struct ph_frame *to)
{
    double rows[ARC_SIZE], value[3];
    for (uint32_t k = 0; k < ARC_SIZE; k++) {
        rows[k] = c[k];
    }
    for (uint32_t order = 0; order < 3; order++) {
        const uint32_t degree = 5 - order;
        double work[ARC_SIZE] = {0.0};
        for (uint32_t k = 0; k < degree; k++) {
            rows[k] = degree * (rows[k + 1] - rows[k]);
            work[k] = rows[k];
        }
        for (uint32_t left = degree - 1; left > 0; left--) {
            for (uint32_t k = 0; k < left; k++) {
                work[k] = work[k] * (1.0 - xi) + work[k + 1] * xi;
            }
        }
        value[order] = work[0];
    }
    const double sigma = speed->sigma, square = sigma * sigma;
    const double e1 = value[0] / sigma, e2 = (value[1] - speed->growth * e1) / square;
    const double third = value[2] - speed->bend * e1;
    frame_put(to, axis, e1, e2, third / (square * sigma) - 3.0 * speed->growth / square * e2);
}

void ph_frames(const struct ph_chain *chain, uint32_t count, const int64_t *segment,
               const double *xi, double *r1, double *r2, double *r3, double *curvature)
{
    for (uint32_t k = 0; k < count; k++) {
        const size_t at = (size_t)segment[k];
        const struct ph_frame to = {r1 + k, r2 + k, r3 + k, count};
        if (chain->planar != 0) {
            curvature[k] = planar_frame(chain->preimage + 6 * at, xi[k], &to);
            continue;
        }
        const struct ph_preimage a = preimage_at(chain->preimage + 12 * at, xi[k]);
        const struct ph_speed speed = {
            inner(a.at, a.at),
            2.0 * inner(a.at, a.first),
            2.0 * (inner(a.first, a.first) + inner(a.at, a.second)),
        };
        curvature[k] = spatial_frame(&a, &speed, &to);
        for (uint32_t e = 0; e < chain->extra; e++) {
            const double *c = chain->extra_axes + ARC_SIZE * (at * chain->extra + e);
            extra_frame(c, xi[k], &speed, SPATIAL_AXES + e, &to);
        }
    }
}
