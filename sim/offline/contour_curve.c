/* SPDX-License-Identifier: MIT */
#include "offline/contour_curve.h"

#include <math.h>

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
    out->end_speed[0] = contour_dot(a[0], a[0]);
    out->end_speed[1] = contour_dot(last, last);
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

void contour_view(const struct contour_segment *s, double xi, const double point[2], struct view *v)
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

double contour_gap(const struct contour *c, struct place place, const double point[2])
{
    struct view v;
    contour_view(&c->segments[place.segment], place.xi, point, &v);
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
