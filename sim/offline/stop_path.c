/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_path.h (see there): the path of a program as a table. Used by offline/stop_search,
 * offline/stop_usage, the other files of this search and host tools. Any thread of a host; the functions change their
 * arguments only. */
#include "offline/stop_path.h"

#include <math.h>
#include <string.h>

#define GROUP_BITS 2u /* 4 rows, or groups of the level below, make a group */

/* Preimage of a segment: Bernstein coefficients by component; u and q, or all four. */
struct preimage {
    double a[3][PROGRAM_COMPONENTS];
    int count;
};

static void read_preimage(const struct program_segment *segment, struct preimage *out)
{
    const uint32_t step = program_component_step(segment->axis_count);
    out->count = 0;
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component += step) {
        for (int k = 0; k < 3; k++) {
            out->a[k][out->count] = ldexp((double)segment->a_q44[component][k], -44);
        }
        out->count++;
    }
}

/* A at xi and its derivatives. */
struct preimage_at {
    double value[PROGRAM_COMPONENTS], first[PROGRAM_COMPONENTS], second[PROGRAM_COMPONENTS];
};

static void evaluate(const struct preimage *w, double xi, struct preimage_at *out)
{
    for (int k = 0; k < w->count; k++) {
        double up = w->a[1][k] - w->a[0][k];
        double bend = w->a[2][k] - 2.0 * w->a[1][k] + w->a[0][k];
        out->value[k] = w->a[0][k] + xi * (2.0 * up + xi * bend);
        out->first[k] = 2.0 * (up + xi * bend);
        out->second[k] = 2.0 * bend;
    }
}

static void planar_row(const struct preimage *w, double xi, struct stop_row *row)
{
    struct preimage_at at = {{0}, {0}, {0}};
    evaluate(w, xi, &at);
    const double *value = at.value;
    const double *first = at.first;
    const double *second = at.second;
    double sigma = value[0] * value[0] + value[1] * value[1];
    double along = value[0] * first[0] + value[1] * first[1];
    double turn = value[0] * first[1] - value[1] * first[0];
    double turn2 = value[0] * second[1] - value[1] * second[0];
    row->tangent[0] = (value[0] * value[0] - value[1] * value[1]) / sigma;
    row->tangent[1] = 2.0 * value[0] * value[1] / sigma;
    row->curvature = 2.0 * turn / (sigma * sigma);
    row->slope = (2.0 * turn2 - 8.0 * turn * along / sigma) / (sigma * sigma * sigma);
}

/* The symmetric forms of two preimages that give x', y', z' and sigma. */
static void forms(const double a[PROGRAM_COMPONENTS], const double b[PROGRAM_COMPONENTS],
                  double out[4])
{
    enum { U = PROGRAM_U, V = PROGRAM_V, P = PROGRAM_P, Q = PROGRAM_Q };
    const double uv = a[U] * b[U] + a[V] * b[V];
    const double pq = a[P] * b[P] + a[Q] * b[Q];
    out[0] = uv - pq;
    out[1] = a[U] * b[Q] + a[Q] * b[U] + a[V] * b[P] + a[P] * b[V];
    out[2] = a[V] * b[Q] + a[Q] * b[V] - a[U] * b[P] - a[P] * b[U];
    out[3] = uv + pq;
}

/* First to third derivative of an extra axis by xi. */
static void extra_at(const struct program_extra *extra, double xi, double out[3])
{
    double d[5];
    for (int k = 0; k < 5; k++) {
        d[k] = ldexp(5.0 * (double)(extra->b_q40[k] - (k > 0 ? extra->b_q40[k - 1] : 0)), -40);
    }
    const double c1 = 4.0 * (d[1] - d[0]);
    const double c2 = 6.0 * (d[2] - 2.0 * d[1] + d[0]);
    const double c3 = 4.0 * (d[3] - 3.0 * d[2] + 3.0 * d[1] - d[0]);
    const double c4 = d[4] - 4.0 * d[3] + 6.0 * d[2] - 4.0 * d[1] + d[0];
    out[0] = d[0] + xi * (c1 + xi * (c2 + xi * (c3 + xi * c4)));
    out[1] = c1 + xi * (2.0 * c2 + xi * (3.0 * c3 + xi * 4.0 * c4));
    out[2] = 2.0 * c2 + xi * (6.0 * c3 + xi * 12.0 * c4);
}

/* From derivatives by xi to those by arc length; sigma and its first two derivatives. */
static void by_arc_length(const double d[3], const double sigma[3], uint32_t axis,
                          struct stop_bend *bend)
{
    const double first = d[0] / sigma[0];
    const double second = (d[1] - sigma[1] * first) / (sigma[0] * sigma[0]);
    const double rest = d[2] - sigma[2] * first - 3.0 * sigma[0] * sigma[1] * second;
    bend->by_mm[0][axis] = first;
    bend->by_mm[1][axis] = second;
    bend->by_mm[2][axis] = rest / (sigma[0] * sigma[0] * sigma[0]);
}

/* The third derivative of the path across its tangent: along it, it is the square of the curvature with a minus
 * sign. */
static double across(const struct stop_bend *bend, double curvature)
{
    double square = 0.0;
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        const double part = bend->by_mm[2][axis] + curvature * curvature * bend->by_mm[0][axis];
        square += part * part;
    }
    return sqrt(square);
}

static void spatial_row(const struct program_segment *segment, const struct preimage *w, double xi,
                        struct stop_row *row, struct stop_bend *bend)
{
    struct preimage_at at = {{0}, {0}, {0}}; /* of a spatial segment all components are set */
    double of[3][4];
    double mixed[4];
    evaluate(w, xi, &at);
    forms(at.value, at.value, of[0]);
    forms(at.value, at.first, of[1]);
    forms(at.first, at.first, of[2]);
    forms(at.value, at.second, mixed);
    for (int k = 0; k < 4; k++) {
        of[1][k] *= 2.0;
        of[2][k] = 2.0 * (of[2][k] + mixed[k]);
    }
    const double sigma[3] = {of[0][3], of[1][3], of[2][3]};
    row->tangent[0] = row->tangent[1] = row->slope = row->curvature = 0.0;
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        const double d[3] = {of[0][axis], of[1][axis], of[2][axis]};
        by_arc_length(d, sigma, axis, bend);
        row->curvature = hypot(row->curvature, bend->by_mm[1][axis]);
    }
    row->slope = across(bend, row->curvature);
    for (uint32_t i = 0; i < program_extra_axes(segment->axis_count); i++) {
        double d[3];
        extra_at(&segment->extra[i], xi, d);
        by_arc_length(d, sigma, PROGRAM_SPACE + i, bend);
    }
}

/* Arc length from the start of the segment: the integral of |A|^2. */
static double arc_length_to(const struct preimage *w, double xi)
{
    double b[5] = {0};
    for (int k = 0; k < w->count; k++) {
        b[0] += w->a[0][k] * w->a[0][k];
        b[1] += w->a[0][k] * w->a[1][k];
        b[2] += (2.0 * w->a[1][k] * w->a[1][k] + w->a[0][k] * w->a[2][k]) / 3.0;
        b[3] += w->a[1][k] * w->a[2][k];
        b[4] += w->a[2][k] * w->a[2][k];
    }
    /* in powers of xi */
    double c1 = 4.0 * (b[1] - b[0]);
    double c2 = 6.0 * (b[2] - 2.0 * b[1] + b[0]);
    double c3 = 4.0 * (b[3] - 3.0 * b[2] + 3.0 * b[1] - b[0]);
    double c4 = b[4] - 4.0 * b[3] + 6.0 * b[2] - 4.0 * b[1] + b[0];
    return xi * (b[0] + xi * (c1 / 2.0 + xi * (c2 / 3.0 + xi * (c3 / 4.0 + xi * c4 / 5.0))));
}

static double feed_here(const struct stop_limits *limits, const struct stop_row *row)
{
    double bend = fabs(row->curvature);
    double most = bend > 0.0 ? sqrt(limits->centripetal / bend) : HUGE_VAL;
    return most < limits->feed ? most : limits->feed;
}

/* The first of `count` rows at or after an arc length. */
static uint32_t first_row_from(const struct stop_row *rows, uint32_t count, double s_mm)
{
    uint32_t low = 0;
    uint32_t high = count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2u;
        if (rows[middle].s_mm < s_mm) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

static void cap_rows(const struct stop_limits *limits, struct stop_row *rows, uint32_t count)
{
    for (uint32_t i = 0; i < limits->zone_count; i++) {
        const struct stop_feed_zone *cap = &limits->zones[i];
        uint32_t k = first_row_from(rows, count, cap->from_mm);
        for (; k < count && rows[k].s_mm <= cap->to_mm; k++) {
            if (cap->feed_mm_s < rows[k].feed_mm_s) {
                rows[k].feed_mm_s = cap->feed_mm_s;
            }
        }
    }
}

static void stretch_begin(struct stop_stretch *stretch)
{
    memset(stretch, 0, sizeof *stretch);
    stretch->feed_mm_s = HUGE_VAL;
}

static void stretch_add_bend(struct stop_bend *most, const struct stop_bend *bend, uint32_t axes)
{
    for (int order = 0; order < 3; order++) {
        for (uint32_t k = 0; k < axes; k++) {
            most->by_mm[order][k] =
                stop_greater(most->by_mm[order][k], fabs(bend->by_mm[order][k]));
        }
    }
}

static void stretch_add_row(struct stop_stretch *stretch, const struct stop_row *rows,
                            const struct stop_bend *bends, uint32_t at, uint32_t axes)
{
    const struct stop_row *row = &rows[at];
    stretch->feed_mm_s = stop_lesser(stretch->feed_mm_s, row->feed_mm_s);
    stretch->bent = fabs(row->curvature) > stretch->curvature ? at : stretch->bent;
    stretch->bending = fabs(row->slope) > stretch->slope ? at : stretch->bending;
    stretch->curvature = stop_greater(stretch->curvature, fabs(row->curvature));
    stretch->slope = stop_greater(stretch->slope, fabs(row->slope));
    if (axes != PROGRAM_PLANE) {
        stretch_add_bend(&stretch->bend, &bends[at], axes);
        return;
    }
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        stretch->tangent[k] = stop_greater(stretch->tangent[k], fabs(row->tangent[k]));
    }
}

static void stretch_add(struct stop_stretch *stretch, const struct stop_stretch *other,
                        uint32_t axes)
{
    stretch->feed_mm_s = stop_lesser(stretch->feed_mm_s, other->feed_mm_s);
    stretch->bent = other->curvature > stretch->curvature ? other->bent : stretch->bent;
    stretch->bending = other->slope > stretch->slope ? other->bending : stretch->bending;
    stretch->curvature = stop_greater(stretch->curvature, other->curvature);
    stretch->slope = stop_greater(stretch->slope, other->slope);
    if (axes != PROGRAM_PLANE) {
        stretch_add_bend(&stretch->bend, &other->bend, axes);
        return;
    }
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        stretch->tangent[k] = stop_greater(stretch->tangent[k], other->tangent[k]);
    }
}

uint32_t stop_groups(uint32_t segment_count)
{
    uint32_t sum = 0;
    for (uint32_t count = segment_count * STOP_ROWS >> GROUP_BITS; count > 0;
         count >>= GROUP_BITS) {
        sum += count;
    }
    return sum;
}

/* The greatest values of the rows of each group; a group that is not full is none. */
static void group_rows(const struct program *p, const struct stop_path *path)
{
    const uint32_t axes = p->header.axis_count;
    struct stop_stretch *below = NULL;
    struct stop_stretch *own = path->groups;
    uint32_t count = p->header.segment_count * STOP_ROWS >> GROUP_BITS;
    for (; count > 0; count >>= GROUP_BITS) {
        for (uint32_t i = 0; i < count; i++) {
            stretch_begin(&own[i]);
            for (uint32_t k = i << GROUP_BITS; k < (i + 1u) << GROUP_BITS; k++) {
                if (below == NULL) {
                    stretch_add_row(&own[i], path->rows, path->bends, k, axes);
                } else {
                    stretch_add(&own[i], &below[k], axes);
                }
            }
        }
        below = own;
        own += count;
    }
}

void stop_rows(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path)
{
    for (uint32_t i = 0; i < p->header.segment_count; i++) {
        struct program_segment segment;
        struct preimage w;
        program_segment_get(p, i, &segment);
        read_preimage(&segment, &w);
        for (uint32_t k = 0; k < STOP_ROWS; k++) {
            const uint32_t at = i * STOP_ROWS + k;
            struct stop_row *row = &path->rows[at];
            double xi = (double)k / (STOP_ROWS - 1u);
            if (segment.axis_count == PROGRAM_PLANE) {
                planar_row(&w, xi, row);
            } else {
                spatial_row(&segment, &w, xi, row, &path->bends[at]);
            }
            row->s_mm = ldexp((double)segment.start_q40_mm, -40) + arc_length_to(&w, xi);
            row->feed_mm_s = feed_here(limits, row);
        }
    }
    cap_rows(limits, path->rows, p->header.segment_count * STOP_ROWS);
    group_rows(p, path);
}

uint32_t stop_row_at(const struct stop_lookup *lookup, double s)
{
    uint32_t low = 0;
    uint32_t high = lookup->row_count - 1u;
    while (high - low > 1u) {
        uint32_t middle = low + (high - low) / 2u;
        if (lookup->rows[middle].s_mm <= s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

void stop_pass_rows(const struct stop_lookup *lookup, double s, uint32_t *row)
{
    while (*row + 2u < lookup->row_count && lookup->rows[*row + 1u].s_mm <= s) {
        (*row)++;
    }
}

/* The first row after both a row and an arc length; the last one if there is none. It is sought from the row that was
 * found last. */
static uint32_t row_after(const struct stop_lookup *lookup, uint32_t row, double to_mm)
{
    const struct stop_row *rows = lookup->rows;
    const uint32_t last = lookup->row_count - 1u;
    uint32_t low = row;
    uint32_t high = row < last ? row + 1u : last;
    const uint32_t near = lookup->last->row;
    uint32_t step = 1u;
    if (near > high && rows[near].s_mm <= to_mm) {
        low = near;
        high = near < last ? near + 1u : last;
    } else if (near > high) {
        high = near;
        while (high - low > step && rows[high - step].s_mm > to_mm) {
            high -= step;
            step *= 2u;
        }
        low = high - low > step ? high - step : low;
        step = 0u;
    }
    for (; step != 0u && high < last && rows[high].s_mm <= to_mm; step *= 2u) {
        low = high;
        high = last - high > step ? high + step : last;
    }
    while (high - low > 1u) {
        const uint32_t middle = low + (high - low) / 2u;
        if (rows[middle].s_mm <= to_mm) {
            low = middle;
        } else {
            high = middle;
        }
    }
    lookup->last->row = high;
    return high;
}

void stop_stretch_from(const struct stop_lookup *lookup, uint32_t row, double to_mm,
                       struct stop_stretch *stretch)
{
    const uint32_t last = row_after(lookup, row, to_mm);
    stretch_begin(stretch);
    while (row <= last) {
        int level = 0;
        uint32_t size = 1u;
        while (level < lookup->levels && row % (size << GROUP_BITS) == 0u &&
               last - row >= (size << GROUP_BITS) - 1u) {
            size <<= GROUP_BITS;
            level++;
        }
        if (level == 0) {
            stretch_add_row(stretch, lookup->rows, lookup->bends, row, lookup->axis_count);
        } else {
            stretch_add(stretch, &lookup->group[level - 1][row / size], lookup->axis_count);
        }
        row += size;
    }
}

void stop_stretch_of_row(const struct stop_lookup *lookup, uint32_t row,
                         struct stop_stretch *stretch)
{
    stretch_begin(stretch);
    stretch_add_row(stretch, lookup->rows, lookup->bends, row, lookup->axis_count);
}

void stop_lookup_open(struct stop_lookup *lookup, const struct program *p,
                      const struct stop_path *path, struct stop_last *last)
{
    memset(last, 0, sizeof *last);
    lookup->last = last;
    lookup->axis_count = p->header.axis_count;
    lookup->rows = path->rows;
    lookup->bends = path->bends;
    lookup->row_count = p->header.segment_count * STOP_ROWS;
    const struct stop_stretch *group = path->groups;
    lookup->levels = 0;
    for (uint32_t count = lookup->row_count >> GROUP_BITS; count > 0; count >>= GROUP_BITS) {
        lookup->group[lookup->levels++] = group;
        group += count;
    }
}
