/* SPDX-License-Identifier: MIT */
/* Implements offline/contour.h (see there): the contour error: distance of a position from the exact curve. Used by
 * offline/offline and host_tools/hodograph/native. One thread for each struct contour. Changes only its struct and the
 * lent array; no I/O. */
#include "offline/contour.h"

#include <math.h>
#include <stddef.h>

#include "offline/contour_curve.h"

/* A Newton step shorter than this ends the search; the distance is then wrong by about its square
 * times the curvature. */
static const double CONTOUR_STEP_MM = 1e-6;
/* Greatest number of Newton steps; where they fail: samples on each side of the arc length, and steps of the golden
 * section between two of them. */
enum { CONTOUR_STEPS = 12, CONTOUR_SAMPLES = 64, CONTOUR_SECTIONS = 80 };
/* A foot is accepted within this multiple of the distance at the arc length, along the curve. */
static const double CONTOUR_WINDOW = 4.0;

struct foot {
    struct place place;
    double moved_mm; /* along the curve, from the start of the search */
    double distance_mm;
    bool found;
};

/* Distance of the point from the tangent. In the plane without the square and the root of one number. */
static double contour_off_tangent(const struct contour *c, const struct view *v, double square)
{
    const double z = v->offset[0] * v->first[1] - v->offset[1] * v->first[0];
    if (c->axes == PROGRAM_PLANE) {
        return fabs(z) / sqrt(square);
    }
    const double x = v->offset[1] * v->first[2] - v->offset[2] * v->first[1];
    const double y = v->offset[2] * v->first[0] - v->offset[0] * v->first[2];
    return sqrt((x * x + y * y + z * z) / square);
}

/* Newton's iteration for the zero of offset . first. Where the distance is not convex (beyond the
 * centre of curvature) the step is that of Gauss and Newton. */
static struct foot contour_newton(const struct contour *c, struct place start,
                                  const double point[3])
{
    struct foot foot = {start, 0.0, 0.0, false};
    for (int k = 0; k < CONTOUR_STEPS; k++) {
        struct view v;
        contour_view(c, foot.place, point, &v);
        const double along = contour_dot(v.offset, v.first);
        const double square = contour_dot(v.first, v.first);
        const double full = square - contour_dot(v.offset, v.second);
        const double step = along / (full > 0.25 * square ? full : square);
        if (step * step * square < CONTOUR_STEP_MM * CONTOUR_STEP_MM) {
            foot.distance_mm = contour_off_tangent(c, &v, square);
            foot.found = true;
            return foot;
        }
        const double before = foot.place.xi;
        foot.place.xi += step;
        foot.moved_mm += step * sqrt(square);
        if ((foot.place.xi > 1.0 || foot.place.xi < 0.0) && !contour_cross(c, &foot.place) &&
            before == foot.place.xi) {
            foot.distance_mm = sqrt(contour_dot(v.offset, v.offset));
            foot.found = true;
            return foot;
        }
    }
    return foot;
}

static double contour_gap_at(const struct contour *c, double arc_length_mm, const double point[3])
{
    return contour_gap(c, contour_place(c, c->cursor, contour_wrap(c, arc_length_mm)), point);
}

/* Slow but without failure: samples the window, then searches around the best sample by golden sections. *foot_mm is
 * the arc length found. */
static double contour_search(const struct contour *c, double arc_length_mm, double window_mm,
                             const double point[3], double *foot_mm)
{
    const double golden = 0.61803398874989484820;
    const double half =
        c->closed && window_mm > 0.5 * c->length_mm ? 0.5 * c->length_mm : window_mm;
    const double spacing = half / CONTOUR_SAMPLES;
    double best = arc_length_mm;
    double least = contour_gap_at(c, best, point);
    for (int i = -CONTOUR_SAMPLES; i <= CONTOUR_SAMPLES; i++) {
        const double gap = contour_gap_at(c, arc_length_mm + i * spacing, point);
        if (gap < least) {
            least = gap;
            best = arc_length_mm + i * spacing;
        }
    }
    double low = best - spacing;
    double high = best + spacing;
    for (int i = 0; i < CONTOUR_SECTIONS; i++) {
        const double inner_low = high - golden * (high - low);
        const double inner_high = low + golden * (high - low);
        if (contour_gap_at(c, inner_low, point) < contour_gap_at(c, inner_high, point)) {
            high = inner_high;
        } else {
            low = inner_low;
        }
    }
    const double gap = contour_gap_at(c, 0.5 * (low + high), point);
    *foot_mm = gap < least ? 0.5 * (low + high) : best;
    return gap < least ? gap : least;
}

/* The distance, and the place on the curve from which it is measured. */
static double contour_foot(struct contour *c, double arc_length_mm, const double point[3],
                           struct place *place)
{
    const double arc =
        arc_length_mm > c->length_mm ? c->length_mm : (arc_length_mm >= 0.0 ? arc_length_mm : 0.0);
    const struct place start = contour_place(c, c->cursor, arc);
    c->cursor = start.segment;
    const double gap = contour_gap(c, start, point);
    const struct foot foot = contour_newton(c, start, point);
    const double window = CONTOUR_WINDOW * gap + 0.001;
    if (foot.found && foot.distance_mm <= gap + CONTOUR_STEP_MM && fabs(foot.moved_mm) <= window) {
        *place = foot.place;
        return foot.distance_mm;
    }
    double foot_mm;
    const double distance_mm = contour_search(c, arc, window, point, &foot_mm);
    *place = contour_place(c, c->cursor, contour_wrap(c, foot_mm));
    return distance_mm;
}

double contour_distance_mm(struct contour *c, double arc_length_mm, const double point[3])
{
    struct place place;
    return contour_foot(c, arc_length_mm, point, &place);
}

/* x, y, z of a row of counts. */
static void contour_point(const struct contour *c, const int32_t *act_counts,
                          const uint32_t *counts_per_unit, double point[3])
{
    for (uint32_t j = 0; j < 3; j++) {
        point[j] = j < c->axes ? (double)act_counts[j] * (1.0 / (double)counts_per_unit[j]) : 0.0;
    }
}

void contour_errors_um(struct contour *c, uint32_t n, const int64_t *arc_length_q40_mm,
                       const int32_t *act_counts, uint32_t stride, const uint32_t *counts_per_unit,
                       double *errors_um)
{
    for (uint32_t i = 0; i < n; i++) {
        double point[3];
        contour_point(c, &act_counts[(size_t)stride * i], counts_per_unit, point);
        errors_um[i] = 1000.0 * contour_distance_mm(c, contour_q40(arc_length_q40_mm[i]), point);
    }
}

/* Position of an extra axis at xi, mm or degrees. */
static double contour_extra(const struct program_extra *extra, double xi)
{
    double b[6] = {0.0};
    for (int k = 1; k < 6; k++) {
        b[k] = contour_q40(extra->b_q40[k - 1]);
    }
    for (int degree = 5; degree > 0; degree--) {
        for (int k = 0; k < degree; k++) {
            b[k] += (b[k + 1] - b[k]) * xi;
        }
    }
    return contour_q40(extra->start_q40) + b[0];
}

void contour_extra_errors(struct contour *c, const struct program *program, uint32_t n,
                          const int64_t *arc_length_q40_mm, const int32_t *act_counts,
                          const uint32_t *counts_per_unit, double *errors)
{
    const uint32_t axes = program->header.axis_count;
    const uint32_t extras = program_extra_axes(axes);
    for (uint32_t i = 0; i < n; i++) {
        const int32_t *act = &act_counts[(size_t)axes * i];
        struct place place;
        struct program_segment segment;
        double point[3];
        contour_point(c, act, counts_per_unit, point);
        (void)contour_foot(c, contour_q40(arc_length_q40_mm[i]), point, &place);
        program_segment_get(program, place.segment, &segment);
        const double xi = place.xi < 0.0 ? 0.0 : (place.xi > 1.0 ? 1.0 : place.xi);
        for (uint32_t k = 0; k < extras; k++) {
            const uint32_t axis = program_curve_axes(axes) + k;
            errors[(size_t)extras * i + k] = (double)act[axis] / (double)counts_per_unit[axis] -
                                             contour_extra(&segment.extra[k], xi);
        }
    }
}
