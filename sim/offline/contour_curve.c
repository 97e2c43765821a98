/* SPDX-License-Identifier: MIT */
/* Implements offline/contour_curve.h (see there): places on the curve, for contour.c. Called by offline/contour,
 * offline/offline and host tools. All functions except contour_begin are pure. One thread for each struct contour. */
#include "offline/contour_curve.h"

#include <math.h>

/* The hodograph of the preimage A is A i A*, a quadratic form; this is scale times the bilinear one that belongs to
 * it. */
static void hodograph_product(const double a[4], const double b[4], double scale, double out[3])
{
    out[0] = scale * (a[PROGRAM_U] * b[PROGRAM_U] + a[PROGRAM_V] * b[PROGRAM_V] -
                      a[PROGRAM_P] * b[PROGRAM_P] - a[PROGRAM_Q] * b[PROGRAM_Q]);
    out[1] = scale * (a[PROGRAM_U] * b[PROGRAM_Q] + a[PROGRAM_Q] * b[PROGRAM_U] +
                      a[PROGRAM_V] * b[PROGRAM_P] + a[PROGRAM_P] * b[PROGRAM_V]);
    out[2] = scale * (a[PROGRAM_V] * b[PROGRAM_Q] + a[PROGRAM_Q] * b[PROGRAM_V] -
                      a[PROGRAM_U] * b[PROGRAM_P] - a[PROGRAM_P] * b[PROGRAM_U]);
}

/* The preimage as powers of xi: A = a0 + a1 xi + a2 xi^2. */
static void contour_powers(const struct program_segment *s, double a[3][4])
{
    const double unit = 1.0 / 17592186044416.0; /* 2^-44 */
    for (uint32_t j = 0; j < PROGRAM_COMPONENTS; j++) {
        const int64_t *w = s->a_q44[j];
        a[0][j] = (double)w[0] * unit;
        a[1][j] = (double)(2 * (w[1] - w[0])) * unit;
        a[2][j] = (double)(w[0] - 2 * w[1] + w[2]) * unit;
    }
}

/* r = integral of the hodograph. */
static void contour_integrate(double a[3][4], double r[5][3])
{
    double part[3];
    hodograph_product(a[0], a[0], 1.0, r[0]);
    hodograph_product(a[0], a[1], 1.0, r[1]);
    hodograph_product(a[1], a[1], 1.0 / 3.0, r[2]);
    hodograph_product(a[0], a[2], 2.0 / 3.0, part);
    for (int j = 0; j < 3; j++) {
        r[2][j] += part[j];
    }
    hodograph_product(a[1], a[2], 0.5, r[3]);
    hodograph_product(a[2], a[2], 0.2, r[4]);
}

/* |A|^2, which is the parametric speed. */
static double speed_of(const double a[4])
{
    return a[PROGRAM_U] * a[PROGRAM_U] + a[PROGRAM_Q] * a[PROGRAM_Q] + a[PROGRAM_V] * a[PROGRAM_V] +
           a[PROGRAM_P] * a[PROGRAM_P];
}

static void contour_expand(const struct program_segment *s, double end_mm,
                           struct contour_segment *out)
{
    double a[3][4];
    double last[4];
    contour_powers(s, a);
    contour_integrate(a, out->r);
    for (uint32_t j = 0; j < PROGRAM_COMPONENTS; j++) {
        last[j] = a[0][j] + a[1][j] + a[2][j];
    }
    out->start_mm = contour_q40(s->start_q40_mm);
    out->length_mm = end_mm - out->start_mm;
    out->per_length = 1.0 / out->length_mm;
    out->end_speed[0] = speed_of(a[0]);
    out->end_speed[1] = speed_of(last);
    out->slope[0] = out->length_mm / out->end_speed[0];
    out->slope[1] = out->length_mm / out->end_speed[1];
    for (int j = 0; j < 3; j++) {
        out->origin[j] = contour_q40(s->point_q40_mm[j]);
    }
}

void contour_begin(struct contour *c, const struct program *program,
                   struct contour_segment *segments)
{
    const uint32_t count = program->header.segment_count;
    c->segments = segments;
    c->count = count;
    c->cursor = 0;
    c->axes = program_curve_axes(program->header.axis_count);
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

double contour_wrap(const struct contour *c, double arc_length_mm)
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

/* The cubic with the right values and slopes at both ends. */
struct place contour_place(const struct contour *c, uint32_t hint, double arc_length_mm)
{
    const uint32_t i = contour_find(c, hint, arc_length_mm);
    const struct contour_segment *s = &c->segments[i];
    const double t = (arc_length_mm - s->start_mm) * s->per_length;
    const double bend = s->slope[0] + s->slope[1] - 2.0;
    const struct place place = {i, t * (s->slope[0] + t * (1.0 - s->slope[0] - bend + t * bend))};
    return place;
}

void contour_view(const struct contour *c, struct place place, const double point[3],
                  struct view *v)
{
    const struct contour_segment *s = &c->segments[place.segment];
    const double xi = place.xi;
    *v = (struct view){.offset = {0.0}};
    for (uint32_t j = 0; j < c->axes; j++) {
        const double r0 = s->r[0][j], r1 = s->r[1][j], r2 = s->r[2][j], r3 = s->r[3][j],
                     r4 = s->r[4][j];
        v->offset[j] =
            (point[j] - s->origin[j]) - xi * (r0 + xi * (r1 + xi * (r2 + xi * (r3 + xi * r4))));
        v->first[j] = r0 + xi * (2.0 * r1 + xi * (3.0 * r2 + xi * (4.0 * r3 + xi * (5.0 * r4))));
        v->second[j] = 2.0 * r1 + xi * (6.0 * r2 + xi * (12.0 * r3 + xi * (20.0 * r4)));
    }
}

double contour_gap(const struct contour *c, struct place place, const double point[3])
{
    struct view v;
    contour_view(c, place, point, &v);
    return sqrt(contour_dot(v.offset, v.offset));
}

bool contour_cross(const struct contour *c, struct place *p)
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
