/* SPDX-License-Identifier: MIT */
#include "rig/contour.h"

#include <math.h>
#include <stddef.h>

/* A Newton step shorter than this ends the search; the distance is then wrong by about its square
 * times the curvature. */
static const double CONTOUR_STEP_MM = 1e-6;
enum { CONTOUR_STEPS = 12, CONTOUR_SAMPLES = 64, CONTOUR_SECTIONS = 80 };
static const double CONTOUR_WINDOW = 4.0;

/* A place on the curve. */
struct place {
    uint32_t segment;
    double xi;
};

/* The curve at a place, seen from a point: offset = point - curve, and the first two derivatives of
 * the curve. */
struct view {
    double offset[2];
    double first[2];
    double second[2];
};

struct foot {
    struct place place;
    double moved_mm; /* along the curve from where the search began */
    double distance_mm;
    bool found;
};

static double contour_q40(int64_t q40)
{
    return (double)q40 * (1.0 / 1099511627776.0);
}

static double dot(const double a[2], const double b[2])
{
    return a[0] * b[0] + a[1] * b[1];
}

static void complex_product(const double a[2], const double b[2], double scale, double out[2])
{
    out[0] = scale * (a[0] * b[0] - a[1] * b[1]);
    out[1] = scale * (a[0] * b[1] + a[1] * b[0]);
}

/* w as powers of xi: w = a0 + a1 xi + a2 xi^2. */
static void contour_powers(const struct program_segment *s, double a[3][2])
{
    const double unit = 1.0 / 17592186044416.0; /* 2^-44 */
    for (int j = 0; j < 2; j++) {
        const int64_t *w = j == 0 ? s->u_q44 : s->v_q44;
        a[0][j] = (double)w[0] * unit;
        a[1][j] = (double)(2 * (w[1] - w[0])) * unit;
        a[2][j] = (double)(w[0] - 2 * w[1] + w[2]) * unit;
    }
}

/* r = integral of w^2. */
static void contour_integrate(double a[3][2], double r[5][2])
{
    double part[2];
    complex_product(a[0], a[0], 1.0, r[0]);
    complex_product(a[0], a[1], 1.0, r[1]);
    complex_product(a[1], a[1], 1.0 / 3.0, r[2]);
    complex_product(a[0], a[2], 2.0 / 3.0, part);
    r[2][0] += part[0];
    r[2][1] += part[1];
    complex_product(a[1], a[2], 0.5, r[3]);
    complex_product(a[2], a[2], 0.2, r[4]);
}

static void contour_expand(const struct program_segment *s, double end_mm,
                           struct contour_segment *out)
{
    double a[3][2];
    contour_powers(s, a);
    contour_integrate(a, out->r);
    const double last[2] = {a[0][0] + a[1][0] + a[2][0], a[0][1] + a[1][1] + a[2][1]};
    out->start_mm = contour_q40(s->start_q40_mm);
    out->length_mm = end_mm - out->start_mm;
    out->per_length = 1.0 / out->length_mm;
    out->end_speed[0] = dot(a[0], a[0]);
    out->end_speed[1] = dot(last, last);
    out->slope[0] = out->length_mm / out->end_speed[0];
    out->slope[1] = out->length_mm / out->end_speed[1];
    out->origin[0] = contour_q40(s->x_q40_mm);
    out->origin[1] = contour_q40(s->y_q40_mm);
}

void contour_begin(struct contour *c, const struct program *program,
                   struct contour_segment *segments)
{
    const uint32_t count = program->header.segment_count;
    c->segments = segments;
    c->count = count;
    c->cursor = 0;
    c->closed = (program->header.flags & PROGRAM_FLAG_CLOSED) != 0;
    c->length_mm = contour_q40(program->header.length_q40_mm);
    double end_mm = c->length_mm;
    for (uint32_t i = count; i-- > 0;) {
        struct program_segment s;
        program_segment_get(program, i, &s);
        contour_expand(&s, end_mm, &segments[i]);
        end_mm = segments[i].start_mm;
    }
}

/* Brings an arc length into the program: modulo the length on a closed path, else clamped. */
static double contour_wrap(const struct contour *c, double arc_length_mm)
{
    if (c->closed && arc_length_mm < 0.0) {
        return arc_length_mm + c->length_mm;
    }
    if (c->closed && arc_length_mm > c->length_mm) {
        return arc_length_mm - c->length_mm;
    }
    if (arc_length_mm > c->length_mm) {
        return c->length_mm;
    }
    return arc_length_mm >= 0.0 ? arc_length_mm : 0.0;
}

static bool contour_holds(const struct contour *c, uint32_t i, double arc_length_mm)
{
    return arc_length_mm >= c->segments[i].start_mm &&
           (i + 1 == c->count || arc_length_mm < c->segments[i + 1].start_mm);
}

/* The segment that holds an arc length: the last one used, its successor, or by bisection. */
static uint32_t contour_find(const struct contour *c, uint32_t hint, double arc_length_mm)
{
    if (contour_holds(c, hint, arc_length_mm)) {
        return hint;
    }
    if (hint + 1 < c->count && contour_holds(c, hint + 1, arc_length_mm)) {
        return hint + 1;
    }
    uint32_t low = 0;
    uint32_t high = c->count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (c->segments[middle].start_mm <= arc_length_mm) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* About the parameter of an arc length: cubic with the right values and slopes at both ends. Good
 * enough to start from; no result depends on it being exact. */
static struct place contour_place(const struct contour *c, uint32_t hint, double arc_length_mm)
{
    const uint32_t i = contour_find(c, hint, arc_length_mm);
    const struct contour_segment *s = &c->segments[i];
    const double t = (arc_length_mm - s->start_mm) * s->per_length;
    const double bend = s->slope[0] + s->slope[1] - 2.0;
    const struct place place = {i, t * (s->slope[0] + t * (1.0 - s->slope[0] - bend + t * bend))};
    return place;
}

static void contour_view(const struct contour_segment *s, double xi, const double point[2],
                         struct view *v)
{
    for (int j = 0; j < 2; j++) {
        const double r0 = s->r[0][j], r1 = s->r[1][j], r2 = s->r[2][j], r3 = s->r[3][j],
                     r4 = s->r[4][j];
        v->offset[j] =
            (point[j] - s->origin[j]) - xi * (r0 + xi * (r1 + xi * (r2 + xi * (r3 + xi * r4))));
        v->first[j] = r0 + xi * (2.0 * r1 + xi * (3.0 * r2 + xi * (4.0 * r3 + xi * (5.0 * r4))));
        v->second[j] = 2.0 * r1 + xi * (6.0 * r2 + xi * (12.0 * r3 + xi * (20.0 * r4)));
    }
}

static double contour_gap(const struct contour *c, struct place place, const double point[2])
{
    struct view v;
    contour_view(&c->segments[place.segment], place.xi, point, &v);
    return sqrt(dot(v.offset, v.offset));
}

/* Takes a parameter that has left [0, 1] over into the neighbour. False at the end of an open path:
 * xi is clamped. */
static bool contour_cross(const struct contour *c, struct place *p)
{
    const bool forward = p->xi > 1.0;
    const bool outermost = p->segment == (forward ? c->count - 1 : 0);
    if (outermost && !c->closed) {
        p->xi = forward ? 1.0 : 0.0;
        return false;
    }
    const double *speed = c->segments[p->segment].end_speed;
    const double beyond_mm = forward ? (p->xi - 1.0) * speed[1] : -p->xi * speed[0];
    if (outermost) {
        p->segment = forward ? 0 : c->count - 1;
    } else {
        p->segment = forward ? p->segment + 1 : p->segment - 1;
    }
    speed = c->segments[p->segment].end_speed;
    const double inside = beyond_mm / (forward ? speed[0] : speed[1]);
    const double kept = inside < 1.0 ? inside : 1.0;
    p->xi = forward ? kept : 1.0 - kept;
    return true;
}

/* Newton's iteration for the zero of offset . first. Where the distance is not convex (beyond the
 * centre of curvature) the step is that of Gauss and Newton. */
static struct foot contour_newton(const struct contour *c, struct place start,
                                  const double point[2])
{
    struct foot foot = {start, 0.0, 0.0, false};
    for (int k = 0; k < CONTOUR_STEPS; k++) {
        struct view v;
        contour_view(&c->segments[foot.place.segment], foot.place.xi, point, &v);
        const double along = dot(v.offset, v.first);
        const double square = dot(v.first, v.first);
        const double full = square - dot(v.offset, v.second);
        const double step = along / (full > 0.25 * square ? full : square);
        if (step * step * square < CONTOUR_STEP_MM * CONTOUR_STEP_MM) {
            foot.distance_mm =
                fabs(v.offset[0] * v.first[1] - v.offset[1] * v.first[0]) / sqrt(square);
            foot.found = true;
            return foot;
        }
        const double before = foot.place.xi;
        foot.place.xi += step;
        foot.moved_mm += step * sqrt(square);
        if ((foot.place.xi > 1.0 || foot.place.xi < 0.0) && !contour_cross(c, &foot.place) &&
            before == foot.place.xi) {
            foot.distance_mm = sqrt(dot(v.offset, v.offset));
            foot.found = true;
            return foot;
        }
    }
    return foot;
}

static double contour_gap_at(const struct contour *c, double arc_length_mm, const double point[2])
{
    return contour_gap(c, contour_place(c, c->cursor, contour_wrap(c, arc_length_mm)), point);
}

/* Slow and sure: samples the window, then closes in on the best sample by golden sections. */
static double contour_search(const struct contour *c, double arc_length_mm, double window_mm,
                             const double point[2])
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
    return gap < least ? gap : least;
}

double contour_distance_mm(struct contour *c, double arc_length_mm, const double point[2])
{
    const double arc =
        arc_length_mm > c->length_mm ? c->length_mm : (arc_length_mm >= 0.0 ? arc_length_mm : 0.0);
    const struct place start = contour_place(c, c->cursor, arc);
    c->cursor = start.segment;
    const double gap = contour_gap(c, start, point);
    const struct foot foot = contour_newton(c, start, point);
    const double window = CONTOUR_WINDOW * gap + 0.001;
    if (foot.found && foot.distance_mm <= gap + CONTOUR_STEP_MM && fabs(foot.moved_mm) <= window) {
        return foot.distance_mm;
    }
    return contour_search(c, arc, window, point);
}

void contour_errors_um(struct contour *c, uint32_t n, const int64_t *arc_length_q40_mm,
                       const int32_t *act_counts, uint32_t counts_per_mm, double *errors_um)
{
    const double mm_per_count = 1.0 / (double)counts_per_mm;
    for (uint32_t i = 0; i < n; i++) {
        const double point[2] = {(double)act_counts[2 * i] * mm_per_count,
                                 (double)act_counts[2 * i + 1] * mm_per_count};
        errors_um[i] = 1000.0 * contour_distance_mm(c, contour_q40(arc_length_q40_mm[i]), point);
    }
}
