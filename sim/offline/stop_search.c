/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_search.h (see there): the search of stop parameters for each feed piece. */
#include "offline/stop_search.h"

#include <math.h>
#include <string.h>

#include "core/path_brake.h"

#define EVEN_INSTANTS  129    /* of a piece, one as long after the other, */
#define MOST_INSTANTS  1025   /* and with those at places of the path between them; */
#define ROWS_EACH      4      /* of the path, for such an instant */
#define INSTANT_S      0.004  /* between two of them at most, where these are enough, */
#define CLOSE_S        0.0005 /* and in the last look at what was found */
#define STEP_S         0.002  /* between two looks at a brake, */
#define FINE_S         0.0005 /* and in the last look */
#define BRAKE_EACH     5      /* ticks of a brake out of which another may begin, */
#define BRAKE_INSTANTS 16u    /* and instants at which it has begun, about */
#define GREATEST_CODE  255
#define BESIDE         1e-6
#define LEAST_MM_S     1e-4 /* slower is rest */
#define NEVER_S        1e6
#define LONGEST_SHARE  0.1
#define TICKS_MORE     3.0 /* of a brake than of its continuous curve */
#define FEWER 24 /* codes below the greatest: a brake with less than an eighth of a limit is none */
#define LEAST_TICKS                                                                                \
    6.0 /* of a brake that the jerks alone make: with more jerk the way of one tick would count */
#define FAR_TICKS                                                                                  \
    20.0 /* and twice the brake: so far from its end a program has room for a brake, */
#define NO_BRAKE_S 10.0
#define SPARE_SHARE                                                                                \
    1e-4 /* of a limit, in bounds of a whole brake: more than rounding to whole ticks takes; */
#define SURE_EACH                                                                                  \
    12 /* ticks of a brake between two looks whether the rest of it, or so many ticks, surely keep the limits */
#define SPARE_TIME    1.25 /* of brake_time, */
#define SPARE_TICKS   10.0 /* and ticks more */
#define FEED_ROUNDING 1e-9 /* share of a feed that the plan may be above it */
#define FASTER                                                                                     \
    0.03 /* of a feed, or the velocity of an axis: at other rates states are looked at that look-ahead excludes */
#define WAIT_BETTER  0.8   /* of the mean time: rather none than such a brake; */
#define WAIT_AS_GOOD 1.001 /* or such a one that could also take much longer */
#define GROUP_BITS   3u    /* 8 rows, or groups of the level below, make a group */
#define MOST_LEVELS  11
#define NEAR         1.05 /* so near to the least time without limits no other start is tried */

/* What is looked at: one over the limits, less the margin; 0: none. */
struct inverse {
    double feed; /* share of the path's feed that counts: a little less than 1 allows more */
    double velocity[PROGRAM_AXES], axis_acceleration[PROGRAM_AXES], axis_jerk[PROGRAM_AXES],
        reach[PROGRAM_AXES], time_constant[PROGRAM_AXES];
};

/* A state on the path, at an instant of the program. */
struct state {
    double s, v, a;
};

/* An instant of a piece at a feed override: `rate` is a number of override_at(), `slope` the sign of the override's change. */
struct overridden {
    uint32_t instant;
    uint32_t rate;
    int slope;
};

/* One piece with the instants looked at. */
struct piece {
    struct state at[MOST_INSTANTS];
    double at_s[MOST_INSTANTS];  /* since the start of the piece */
    uint32_t row[MOST_INSTANTS]; /* of the path, before it */
    uint32_t count;
    double seconds;
    int most[3];          /* greatest codes */
    int before[3];        /* those of a brake out of which one may begin; 0: none */
    double left_s;        /* of the program, behind the piece */
    struct state fastest; /* of all rates: greatest speed and acceleration */
    struct state extreme; /* of the rate 1: greatest speed and acceleration of either sign */
    double factor;        /* greatest rate of program time; */
    double level[PROGRAM_LEVELS], slope[PROGRAM_LEVELS],
        second[PROGRAM_LEVELS];         /* bounds up to these rates */
    uint32_t suspect;                   /* the instant at which a limit was broken last, */
    struct overridden suspect_override; /* and the same at other feed overrides, */
    struct overridden suspect_before;   /* and where a brake out of another broke one */
    struct piece *close;                /* the same piece with more instants */
};

struct search {
    uint32_t axis_count;
    const struct stop_row *rows;
    const struct stop_bend *bends;                 /* of a spatial program */
    const struct stop_stretch *group[MOST_LEVELS]; /* of 8, 64, ... rows, at each level */
    int levels;
    uint32_t row_count;
    struct inverse inverse;     /* at the rate 1, */
    struct inverse at_any_rate; /* and at others */
    uint32_t rise_is_cut;
    uint32_t quick;
    uint32_t period_us;
    double period_s;
    double length_mm;
    double deceleration; /* greatest */
    int most[3];         /* greatest codes */
};

/* --- Codes --- */

/* The number of a code: jerk, deceleration, jerk for k = 0 ... 2; mm, s. */
static double number_of(int k, int code)
{
    const double mantissa = floor(65536.0 * pow(2.0, (code & 7) / 8.0));
    return ldexp(mantissa, (code >> 3) - (k == 1 ? 24 : 18));
}

/* --- The path --- */

static double over(double limit)
{
    return 1.0 / (limit * (1.0 - STOP_MARGIN)); /* of HUGE_VAL 0 */
}

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

/* What x', y', z' and sigma are of, as symmetric forms of two preimages. */
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
    for (uint32_t i = 0; i < program_extra_axes(segment->axis_count); i++) {
        double d[3];
        extra_at(&segment->extra[i], xi, d);
        by_arc_length(d, sigma, PROGRAM_SPACE + i, bend);
    }
}

/* Arc length from the start of the segment: the integral of |A|^2. */
static double way_to(const struct preimage *w, double xi)
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

/* The first of `count` rows at or behind an arc length. */
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
    for (uint32_t i = 0; i < limits->cap_count; i++) {
        const struct stop_cap *cap = &limits->caps[i];
        uint32_t k = first_row_from(rows, count, cap->from_mm);
        for (; k < count && rows[k].s_mm <= cap->to_mm; k++) {
            if (cap->feed_mm_s < rows[k].feed_mm_s) {
                rows[k].feed_mm_s = cap->feed_mm_s;
            }
        }
    }
}

/* --- Bounds of a stretch --- */

static double greater(double a, double b)
{
    return a > b ? a : b;
}

static double lesser(double a, double b)
{
    return a < b ? a : b;
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
            most->by_mm[order][k] = greater(most->by_mm[order][k], fabs(bend->by_mm[order][k]));
        }
    }
}

static void stretch_add_row(struct stop_stretch *stretch, const struct stop_row *rows,
                            const struct stop_bend *bends, uint32_t at, uint32_t axes)
{
    const struct stop_row *row = &rows[at];
    stretch->feed_mm_s = lesser(stretch->feed_mm_s, row->feed_mm_s);
    if (axes != PROGRAM_PLANE) {
        stretch_add_bend(&stretch->bend, &bends[at], axes);
        return;
    }
    stretch->curvature = greater(stretch->curvature, fabs(row->curvature));
    stretch->slope = greater(stretch->slope, fabs(row->slope));
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        stretch->tangent[k] = greater(stretch->tangent[k], fabs(row->tangent[k]));
    }
}

static void stretch_add(struct stop_stretch *stretch, const struct stop_stretch *other,
                        uint32_t axes)
{
    stretch->feed_mm_s = lesser(stretch->feed_mm_s, other->feed_mm_s);
    if (axes != PROGRAM_PLANE) {
        stretch_add_bend(&stretch->bend, &other->bend, axes);
        return;
    }
    stretch->curvature = greater(stretch->curvature, other->curvature);
    stretch->slope = greater(stretch->slope, other->slope);
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        stretch->tangent[k] = greater(stretch->tangent[k], other->tangent[k]);
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
            row->s_mm = ldexp((double)segment.start_q40_mm, -40) + way_to(&w, xi);
            row->feed_mm_s = feed_here(limits, row);
        }
    }
    cap_rows(limits, path->rows, p->header.segment_count * STOP_ROWS);
    group_rows(p, path);
}

/* The last row at or before an arc length. */
static uint32_t row_at(const struct search *search, double s)
{
    uint32_t low = 0;
    uint32_t high = search->row_count - 1u;
    while (high - low > 1u) {
        uint32_t middle = low + (high - low) / 2u;
        if (search->rows[middle].s_mm <= s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* --- What a motion asks of the limits --- */

static double between(double a, double b, double share)
{
    return a + (b - a) * share;
}

/* The motion of the axes: velocity, acceleration, jerk by axis. */
struct axes {
    double velocity[PROGRAM_AXES], acceleration[PROGRAM_AXES], jerk[PROGRAM_AXES];
};

static void planar_axes_of(const struct stop_row *low, double share, const struct state *at,
                           double j, struct axes *out)
{
    const struct stop_row *high = low + 1;
    double kappa = between(low->curvature, high->curvature, share);
    double slope = between(low->slope, high->slope, share);
    double normal = kappa * at->v * at->v;
    double jerk_along = j - kappa * normal * at->v;
    double jerk_across = (3.0 * kappa * at->a + slope * at->v * at->v) * at->v;
    double tx = between(low->tangent[0], high->tangent[0], share);
    double ty = between(low->tangent[1], high->tangent[1], share);
    out->velocity[0] = at->v * tx;
    out->velocity[1] = at->v * ty;
    out->acceleration[0] = at->a * tx - normal * ty;
    out->acceleration[1] = at->a * ty + normal * tx;
    out->jerk[0] = jerk_along * tx - jerk_across * ty;
    out->jerk[1] = jerk_along * ty + jerk_across * tx;
}

static void spatial_axes_of(const struct search *search, const struct stop_row *low, double share,
                            const struct state *at, double j, struct axes *out)
{
    const struct stop_bend *bend = &search->bends[low - search->rows];
    for (uint32_t k = 0; k < search->axis_count; k++) {
        double first = between(bend[0].by_mm[0][k], bend[1].by_mm[0][k], share);
        double second = between(bend[0].by_mm[1][k], bend[1].by_mm[1][k], share);
        double third = between(bend[0].by_mm[2][k], bend[1].by_mm[2][k], share);
        out->velocity[k] = at->v * first;
        out->acceleration[k] = at->a * first + at->v * at->v * second;
        out->jerk[k] = j * first + at->v * (3.0 * at->a * second + at->v * at->v * third);
    }
}

static void axes_of(const struct search *search, const struct stop_row *low, double share,
                    const struct state *at, double j, struct axes *out)
{
    if (search->axis_count == PROGRAM_PLANE) {
        planar_axes_of(low, share, at, j, out);
    } else {
        spatial_axes_of(search, low, share, at, j, out);
    }
}

static double share_of(const struct stop_row *low, double s)
{
    double way = low[1].s_mm - low->s_mm;
    double share = way > 0.0 ? (s - low->s_mm) / way : 1.0;
    return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
}

/* The greatest share of a limit that the motion uses. */
static double strain(const struct search *search, const struct inverse *inverse,
                     const struct stop_row *low, const struct state *at, double j)
{
    struct axes axes;
    double share = share_of(low, at->s);
    axes_of(search, low, share, at, j, &axes);
    double most = at->v * inverse->feed / between(low->feed_mm_s, low[1].feed_mm_s, share);
    most = low->feed_mm_s < NEVER_S * NEVER_S && low[1].feed_mm_s < NEVER_S * NEVER_S ? most : 0.0;
    for (uint32_t k = 0; k < search->axis_count; k++) {
        most = greater(most, fabs(axes.velocity[k]) * inverse->velocity[k]);
        most = greater(most, fabs(axes.acceleration[k]) * inverse->axis_acceleration[k]);
        most = greater(most, fabs(axes.jerk[k]) * inverse->axis_jerk[k]);
        double pull = axes.velocity[k] + inverse->time_constant[k] * axes.acceleration[k];
        most = greater(most, fabs(pull) * inverse->reach[k]);
    }
    return most;
}

/* --- The brake --- */

/* The one that the controller would make, at arc length 0; 0 where none fits. */
static int brake_begin(struct path_brake *brake, const struct state *from,
                       const struct path_brake_numbers *numbers, double period_s)
{
    const struct path_state state = {
        .speed_q56 = (int64_t)(from->v * period_s * 0x1p56),
        .acceleration_q56 = (int64_t)(from->a * period_s * period_s * 0x1p56),
    };
    return path_brake_begin(brake, &state, numbers);
}

/* How long it takes: the continuous curve, and what whole ticks take more on the mean. */
static double brake_time(const struct state *from, const struct path_brake_numbers *numbers,
                         double period_s)
{
    double tick3 = ldexp(1.0, -56) / (period_s * period_s * period_s);
    double down = (double)numbers->jerk_down_q56 * tick3;
    double up = (double)numbers->jerk_up_q56 * tick3;
    double most = (double)numbers->deceleration_q56 * tick3 * period_s;
    double square = from->a * from->a / down;
    double depth = fmin(sqrt((2.0 * from->v + square) / (1.0 / down + 1.0 / up)), most);
    double change = from->a + depth > 0.0 ? down : -down;
    double speed = from->v + (from->a * from->a - depth * depth) / (2.0 * change);
    double even_s = greater(speed / depth - depth / (2.0 * up), 0.0);
    return fabs(from->a + depth) / down + even_s + depth / up + TICKS_MORE * period_s;
}

static struct state state_of(const struct path_brake *brake, double from_mm, double period_s)
{
    struct state out = {
        .s = from_mm + (double)brake->at.arc_length_q40_mm * 0x1p-40,
        .v = (double)brake->at.speed_q56 * 0x1p-56 / period_s,
        .a = (double)brake->at.acceleration_q56 * 0x1p-56 / (period_s * period_s),
    };
    return out;
}

static struct state moved(const struct state *from, double j, double t)
{
    struct state to = {
        .s = from->s + t * (from->v + t * (from->a / 2.0 + t * j / 6.0)),
        .v = from->v + t * (from->a + t * j / 2.0),
        .a = from->a + t * j,
    };
    return to;
}

/* The last row at or before an arc length, from an earlier one on. */
static void pass_rows(const struct search *search, double s, uint32_t *row)
{
    while (*row + 2u < search->row_count && search->rows[*row + 1u].s_mm <= s) {
        (*row)++;
    }
}

/* 1 while one tick keeps the limits, looked at in `parts` places. */
static int tick_keeps(const struct search *search, const struct inverse *inverse,
                      const struct state *from, const struct state *to, uint32_t *row, int parts)
{
    double j = (to->a - from->a) / search->period_s;
    for (int k = 0; k < parts; k++) {
        struct state at = moved(from, j, search->period_s * k / parts);
        pass_rows(search, at.s, row);
        if (strain(search, inverse, &search->rows[*row], &at, j) > 1.0) {
            return 0;
        }
    }
    return 1;
}

/* Upper bounds of what a brake does, and of the path that it takes. */
struct extent {
    double speed, acceleration, jerk;
    struct stop_stretch path;
};

/* The first row behind both a row and an arc length; the last one if there is none. */
static uint32_t row_behind(const struct search *search, uint32_t row, double to_mm)
{
    const uint32_t last = search->row_count - 1u;
    uint32_t low = row;
    uint32_t high = row < last ? row + 1u : last;
    for (uint32_t step = 1u; high < last && search->rows[high].s_mm <= to_mm; step *= 2u) {
        low = high;
        high = last - high > step ? high + step : last;
    }
    while (high - low > 1u) {
        const uint32_t middle = low + (high - low) / 2u;
        if (search->rows[middle].s_mm <= to_mm) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return high;
}

/* Fills the bounds of the path, from a row up to an arc length. */
static void extend(const struct search *search, uint32_t row, double to_mm, struct extent *extent)
{
    const uint32_t last = row_behind(search, row, to_mm);
    stretch_begin(&extent->path);
    while (row <= last) {
        int level = 0;
        uint32_t size = 1u;
        while (level < search->levels && row % (size << GROUP_BITS) == 0u &&
               last - row >= (size << GROUP_BITS) - 1u) {
            size <<= GROUP_BITS;
            level++;
        }
        if (level == 0) {
            stretch_add_row(&extent->path, search->rows, search->bends, row, search->axis_count);
        } else {
            stretch_add(&extent->path, &search->group[level - 1][row / size], search->axis_count);
        }
        row += size;
    }
}

/* Share of the limits that axes use at most with these bounds. */
static double axis_share(const struct inverse *inverse, uint32_t k, double velocity,
                         double acceleration, double jerk)
{
    double most = velocity * inverse->velocity[k];
    most = greater(most, acceleration * inverse->axis_acceleration[k]);
    most = greater(most, jerk * inverse->axis_jerk[k]);
    return greater(most, (velocity + inverse->time_constant[k] * acceleration) * inverse->reach[k]);
}

/* Greatest component along an axis, for an axis that the tangent has at most this component of. */
static double component(double along, double across, double tangent)
{
    return fmin(hypot(along, across), along * tangent + across);
}

static double planar_share(const struct inverse *inverse, const struct extent *extent)
{
    const struct stop_stretch *path = &extent->path;
    const double normal = path->curvature * extent->speed * extent->speed;
    const double bent = path->slope * extent->speed * extent->speed;
    const double jerk_along = extent->jerk + path->curvature * normal * extent->speed;
    const double jerk_across =
        (3.0 * path->curvature * extent->acceleration + bent) * extent->speed;
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        const double tangent = path->tangent[k];
        const double acceleration = component(extent->acceleration, normal, tangent);
        const double jerk = component(jerk_along, jerk_across, tangent);
        most = greater(most, axis_share(inverse, k, extent->speed * tangent, acceleration, jerk));
    }
    return most;
}

static double spatial_share(const struct search *search, const struct inverse *inverse,
                            const struct extent *extent)
{
    const double v = extent->speed;
    double most = 0.0;
    for (uint32_t k = 0; k < search->axis_count; k++) {
        const double first = extent->path.bend.by_mm[0][k];
        const double second = extent->path.bend.by_mm[1][k];
        const double third = extent->path.bend.by_mm[2][k];
        const double acceleration = extent->acceleration * first + v * v * second;
        const double jerk =
            extent->jerk * first + v * (3.0 * extent->acceleration * second + v * v * third);
        most = greater(most, axis_share(inverse, k, v * first, acceleration, jerk));
    }
    return most;
}

/* 1: no limit is passed anywhere within these bounds. */
static int extent_keeps(const struct search *search, const struct inverse *inverse,
                        const struct extent *extent)
{
    const double along = extent->speed * inverse->feed / extent->path.feed_mm_s;
    const double axes = search->axis_count == PROGRAM_PLANE
                            ? planar_share(inverse, extent)
                            : spatial_share(search, inverse, extent);
    return greater(along, axes) * (1.0 + SPARE_SHARE) <= 1.0;
}

/* 1: no limit is passed on the path between a row and an arc length; `extent` has what the brake does there. */
static int keeps_up_to(const struct search *search, const struct inverse *inverse,
                       struct extent *extent, uint32_t row, double to_mm)
{
    /* Where limits bind, the first row alone shows it as a rule. */
    stretch_begin(&extent->path);
    stretch_add_row(&extent->path, search->rows, search->bends, row, search->axis_count);
    if (!extent_keeps(search, inverse, extent)) {
        return 0;
    }
    extend(search, row, to_mm, extent);
    return extent_keeps(search, inverse, extent);
}

/* Bounds of brakes from states with at most this speed and rise of it, and no more deceleration than `fall`. Returns the arc
 * length that they do not pass. */
static double brake_extent(const struct search *search, const struct path_brake_numbers *numbers,
                           const struct state *most, double fall, struct extent *extent)
{
    const double period_s = search->period_s;
    const double tick2 = ldexp(1.0, -56) / (period_s * period_s);
    const double down = (double)numbers->jerk_down_q56 * tick2 / period_s;
    const double up = (double)numbers->jerk_up_q56 * tick2 / period_s;
    const double most_s =
        SPARE_TIME * brake_time(most, numbers, period_s) + fall / down + SPARE_TICKS * period_s;
    extent->speed = most->v + most->a * (most->a / (2.0 * down) + SPARE_TICKS * period_s);
    extent->acceleration =
        greater(greater(most->a, fall), (double)numbers->deceleration_q56 * tick2);
    extent->jerk = greater(down, up);
    return most->s + extent->speed * most_s;
}

/* 1: the rest of the brake keeps the limits without a look at its ticks; 0: that is open. Most brakes at low rates are far from the
 * limits, and to follow each of them would take nearly all of the time of a search. */
static int surely_keeps(const struct search *search, const struct inverse *inverse,
                        const struct path_brake *brake, double from_mm, uint32_t row)
{
    struct state most = state_of(brake, from_mm, search->period_s);
    const double fall = greater(-most.a, 0.0);
    struct extent extent;
    most.a = greater(most.a, 0.0);
    const double to_mm = brake_extent(search, &brake->numbers, &most, fall, &extent);
    return keeps_up_to(search, inverse, &extent, row, to_mm);
}

/* 1: some ticks of a brake, at[0 ... count], surely keep the limits, by bounds of all of them; 0: that is open. */
static int ticks_surely_keep(const struct search *search, const struct inverse *inverse,
                             const struct state *at, int count, uint32_t row)
{
    const double period_s = search->period_s;
    struct extent extent = {.speed = 0.0, .acceleration = fabs(at[0].a), .jerk = 0.0};
    for (int k = 0; k < count; k++) {
        const double rise = greater(greater(at[k].a, at[k + 1].a), 0.0);
        extent.speed = greater(extent.speed, at[k].v + rise * period_s);
        extent.acceleration = greater(extent.acceleration, fabs(at[k + 1].a));
        extent.jerk = greater(extent.jerk, fabs(at[k + 1].a - at[k].a) / period_s);
    }
    return keeps_up_to(search, inverse, &extent, row, at[count].s);
}

/* 1 while the brake keeps the limits all the way. */
static int brake_keeps(const struct search *search, const struct inverse *inverse,
                       const struct path_brake *brake, double from_mm, uint32_t row, double step_s)
{
    struct path_brake tick = *brake;
    struct state at[SURE_EACH + 1];
    const int parts = (int)ceil(search->period_s / step_s);
    const int each = (int)greater(step_s / search->period_s, 1.0);
    int done = 0;
    at[0] = state_of(&tick, from_mm, search->period_s);
    while (!path_brake_rests(&tick)) {
        if (surely_keeps(search, inverse, &tick, from_mm, row)) {
            return 1;
        }
        int count = 0;
        while (count < SURE_EACH && !path_brake_rests(&tick)) {
            if (done + count == 0) {
                path_brake_first(&tick);
            } else {
                path_brake_step(&tick);
            }
            count++;
            at[count] = state_of(&tick, from_mm, search->period_s);
        }
        const int surely = ticks_surely_keep(search, inverse, at, count, row);
        for (int k = 0; k < count && !surely; k++) {
            if ((done + k) % each == 0 &&
                !tick_keeps(search, inverse, &at[k], &at[k + 1], &row, parts)) {
                return 0;
            }
        }
        done += count;
        at[0] = at[count];
        pass_rows(search, at[0].s, &row);
    }
    return 1;
}

/* --- Pieces --- */

static double piece_value(const double c[8], double u, int order)
{
    double sum = 0.0;
    for (int k = 7; k >= order; k--) {
        double factor = 1.0;
        for (int i = 0; i < order; i++) {
            factor *= k - i;
        }
        sum = sum * u + factor * c[k];
    }
    return sum;
}

/* Powers of u = 0 ... 1 over the piece, mm; returns its duration. */
static double piece_powers(const struct program_piece *from, double c[8])
{
    double seconds = ldexp((double)from->duration_q32_s, -32);
    double unit = ldexp(seconds, -program_piece_exponent(from->duration_q32_s));
    double power = 1.0;
    c[0] = ldexp((double)from->start_q40_mm, -40);
    for (int k = 1; k <= 7; k++) {
        power *= unit;
        c[k] = ldexp((double)from->c_q40_mm[k - 1], -40) * power;
    }
    return seconds;
}

/* Adds an instant, u = 0 ... 1 over the piece, in ascending order; 0: there are too many. */
static int add_instant(const struct search *search, const double c[8], double u,
                       struct piece *piece)
{
    if (piece->count >= MOST_INSTANTS) {
        return 0;
    }
    struct state *at = &piece->at[piece->count];
    at->s = piece_value(c, u, 0);
    at->v = greater(piece_value(c, u, 1) / piece->seconds, 0.0);
    at->a = piece_value(c, u, 2) / (piece->seconds * piece->seconds);
    piece->at_s[piece->count] = u * piece->seconds;
    piece->row[piece->count] = row_at(search, at->s);
    piece->fastest.v = greater(piece->fastest.v, at->v);
    piece->fastest.a = greater(piece->fastest.a, at->a);
    piece->extreme.v = greater(piece->extreme.v, at->v);
    piece->extreme.a = greater(piece->extreme.a, fabs(at->a));
    piece->count++;
    return 1;
}

/* Adds those of a stretch, from the last one to u = high, at which every `each`-th row of the path is passed, no closer
 * to each other than step_s: a bend may be narrower than the even instants are apart. */
static int add_rows(const struct search *search, const double c[8], double high, uint32_t each,
                    double step_s, struct piece *piece)
{
    const double low = piece->at_s[piece->count - 1u] / piece->seconds;
    const double from = piece->at[piece->count - 1u].s;
    const double way = piece_value(c, high, 0) - from;
    uint32_t row = piece->row[piece->count - 1u] + 1u;
    for (; row < search->row_count && search->rows[row].s_mm < from + way; row += each) {
        const double u = low + (high - low) * greater(search->rows[row].s_mm - from, 0.0) / way;
        const double last_s = piece->at_s[piece->count - 1u];
        if (u * piece->seconds >= last_s + step_s &&
            high * piece->seconds >= last_s + 2.0 * step_s && !add_instant(search, c, u, piece)) {
            return 0;
        }
    }
    return 1;
}

/* 0: too many. */
static int add_instants(const struct search *search, const double c[8], uint32_t each,
                        double step_s, struct piece *piece)
{
    const double parts = fmin(greater(ceil(piece->seconds / step_s), 2.0), EVEN_INSTANTS - 1);
    int fits = 1;
    piece->count = 0;
    piece->fastest.s = piece->fastest.v = piece->fastest.a = 0.0;
    piece->extreme = piece->fastest;
    for (int k = 0; k <= (int)parts && fits; k++) {
        if (k > 0 && piece->seconds > 2.0 * parts * step_s) {
            fits = add_rows(search, c, k / parts, each, step_s, piece);
        }
        fits = fits && add_instant(search, c, k / parts, piece);
    }
    return fits;
}

/* The greatest codes of a piece: no less than a stop within LEAST_TICKS from its greatest speed needs, and beyond that only
 * what takes the path that is left after it in as many ticks. */
static void piece_most(const struct search *search, struct piece *piece)
{
    const double span_s = LEAST_TICKS * search->period_s;
    const double left_mm = greater(search->length_mm - piece->at[piece->count - 1u].s, 0.0);
    const double acceleration =
        greater(8.0 * greater(piece->fastest.v, LEAST_MM_S), left_mm / span_s) / span_s;
    for (int k = 0; k < 3; k++) {
        const double most = k == 1 ? acceleration : acceleration / (2.0 * span_s);
        piece->most[k] = search->most[k];
        while (piece->most[k] > 1 && number_of(k, piece->most[k]) > most) {
            piece->most[k]--;
        }
    }
}

static void piece_look(const struct search *search, const struct program *p, uint32_t i,
                       double left_s, double step_s, struct piece *piece)
{
    struct program_piece from;
    double c[8];
    program_piece_get(p, i, &from);
    piece->seconds = piece_powers(&from, c);
    piece->suspect = 0;
    piece->suspect_override = (struct overridden){0, 0, -1};
    piece->suspect_before = (struct overridden){0, 0, 0};
    piece->left_s = left_s;
    piece->factor = ldexp((double)from.override_factor_q24, -24);
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        piece->level[k] =
            k == PROGRAM_LEVEL_FULL ? piece->factor : ldexp((double)program_level_q9(k), -9);
        piece->slope[k] = ldexp((double)program_number(from.override.rate[k]), -32);
        piece->second[k] = ldexp((double)program_number(from.override.second[k]), -24);
    }
    uint32_t each = ROWS_EACH;
    while (!add_instants(search, c, each, step_s, piece)) {
        each *= 2u;
    }
    piece_most(search, piece);
    double little = search->rise_is_cut ? 0.25 * search->deceleration : HUGE_VAL;
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        double rate = piece->level[k];
        double slope = fmin(piece->slope[k], sqrt(rate * piece->second[k])) * piece->fastest.v;
        most = greater(most, piece->fastest.a * rate * rate + fmin(slope, little));
    }
    piece->fastest.v *= piece->factor;
    piece->fastest.a = most;
}

/* Greatest slope at a rate of program time, of a rise (sign 1) or a fall (-1): it came from a rest, and can come to one
 * within the level. */
static double slope_at(const struct piece *piece, double rate, int sign)
{
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        if (rate <= piece->level[k]) {
            double room = sign > 0 ? fmin(rate, piece->level[k] - rate) : rate;
            most = greater(most, fmin(piece->slope[k], sqrt(2.0 * room * piece->second[k])));
        }
    }
    return most;
}

/* --- The search --- */

/* 0: the controller takes no such numbers. */
static int numbers_of(const struct search *search, const int codes[3],
                      struct path_brake_numbers *numbers)
{
    const struct program_stop stop = {
        .jerk_down = (uint8_t)codes[0],
        .deceleration = (uint8_t)codes[1],
        .jerk_up = (uint8_t)codes[2],
    };
    return path_brake_numbers_of(numbers, &stop, search->period_us);
}

/* Times to rest from the instants of a piece, from the last to the first: of a brake, or of waiting for one. */
struct times {
    double mean_s, worst_s, first_s;
    double longest_s;          /* brake at any rate */
    double cost_s;             /* the mean, and a share of the longest */
    int brakes[MOST_INSTANTS]; /* 0: the plan goes on */
};

/* Half the time from the instant before to the one behind. */
static double weight_s(const struct piece *piece, uint32_t i)
{
    const uint32_t last = piece->count - 1u;
    return 0.5 * (piece->at_s[i < last ? i + 1u : last] - piece->at_s[i > 0u ? i - 1u : 0u]);
}

/* Whether the controller would find room for the brake. */
static int has_room(const struct search *search, const struct state *at,
                    const struct path_brake_numbers *numbers)
{
    const struct path_state state = {
        .speed_q56 = (int64_t)(at->v * search->period_s * 0x1p56),
        .acceleration_q56 = (int64_t)(at->a * search->period_s * search->period_s * 0x1p56),
    };
    return path_brake_fits(&state, numbers, (int64_t)ldexp(search->length_mm - at->s, 40));
}

/* after_s: the time to rest from the end of the piece. Returns 0 where the controller would not begin a brake although the
 * program still has far to go. */
static int times_of(const struct search *search, const struct piece *piece,
                    const struct path_brake_numbers *numbers, double after_s, struct times *times)
{
    struct path_brake brake;
    double sum = 0.0;
    times->first_s = after_s;
    times->worst_s = 0.0;
    for (uint32_t i = piece->count; i > 0; i--) {
        const struct state *at = &piece->at[i - 1u];
        double next_s = i == piece->count ? piece->seconds : piece->at_s[i];
        double wait = times->first_s + (next_s - piece->at_s[i - 1u]);
        double left = piece->left_s + (piece->seconds - piece->at_s[i - 1u]);
        /* A brake longer than the rest of the program is not begun. The next instant may have a better one; not counted,
         * or the worst numbers would be the best. */
        int begins = brake_begin(&brake, at, numbers, search->period_s);
        double total_s = begins ? brake_time(at, numbers, search->period_s) : NEVER_S;
        if (begins && at->v * piece->factor > 0.5 * piece->fastest.v &&
            left > 2.0 * total_s + FAR_TICKS * search->period_s && !has_room(search, at, numbers)) {
            return 0;
        }
        times->brakes[i - 1u] = total_s < left;
        times->first_s = total_s < left ? total_s : begins ? left : wait;
        times->worst_s = greater(times->worst_s, times->first_s);
        sum += times->first_s * weight_s(piece, i - 1u);
    }
    times->mean_s = sum / piece->seconds;
    times->longest_s = brake_begin(&brake, &piece->fastest, numbers, search->period_s)
                           ? brake_time(&piece->fastest, numbers, search->period_s)
                           : NO_BRAKE_S;
    times->cost_s = times->mean_s + LONGEST_SHARE * times->longest_s;
    return 1;
}

/* Whether the state has so little speed left, for its deceleration, that no brake need fit: the plan may go on. */
static int may_wait(const struct search *search, const struct state *at,
                    const struct path_brake_numbers *numbers)
{
    double period_s = search->period_s;
    double up = ldexp((double)numbers->jerk_up_q56, -56) / (period_s * period_s * period_s);
    return at->v < LEAST_MM_S ||
           (at->a < 0.0 && at->v < at->a * at->a / (2.0 * up) - 3.0 * at->a * period_s);
}

/* Greatest slope of the rate of program time. */
static double greatest_slope(const struct piece *piece)
{
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        most = greater(most, fmin(piece->slope[k], sqrt(2.0 * piece->level[k] * piece->second[k])));
    }
    return most;
}

/* Bounds of all brakes that begin in the piece, at any rate. */
static void piece_extent(const struct search *search, const struct piece *piece,
                         const struct path_brake_numbers *numbers, struct extent *extent)
{
    const struct piece *close = piece->close;
    const double rate = greater(piece->factor, 1.0);
    const double v = greater(piece->extreme.v, close->extreme.v);
    const double a = greater(piece->extreme.a, close->extreme.a) * rate * rate;
    const double change = greatest_slope(piece) * v;
    const double little = search->rise_is_cut ? 0.25 * search->deceleration : HUGE_VAL;
    const struct state most = {piece->at[piece->count - 1u].s, v * rate, a + fmin(change, little)};
    const double to_mm = brake_extent(search, numbers, &most, a + change, extent);
    extend(search, piece->row[0], to_mm, extent);
}

/* Whether these brakes keep the limits; the instant that broke one last is looked at first. */
static int all_keep(const struct search *search, struct piece *piece, const struct times *times,
                    const struct path_brake_numbers *numbers)
{
    struct extent extent;
    piece_extent(search, piece, numbers, &extent);
    if (extent_keeps(search, &search->inverse, &extent)) {
        return 1;
    }
    for (uint32_t n = 0; n < piece->count; n++) {
        uint32_t i = (n + piece->suspect) % piece->count;
        struct path_brake brake;
        if (times->brakes[i] && brake_begin(&brake, &piece->at[i], numbers, search->period_s) &&
            !brake_keeps(search, &search->inverse, &brake, piece->at[i].s, piece->row[i], STEP_S)) {
            piece->suspect = i;
            return 0;
        }
    }
    return 1;
}

/* What a brake has to keep; `surely`: it does. */
struct keeping {
    const struct inverse *inverse;
    int surely;
};

/* Whether a brake fits and keeps the limits, or need not fit. */
static int state_keeps(const struct search *search, const struct keeping *keeping,
                       const struct state *at, uint32_t row,
                       const struct path_brake_numbers *numbers)
{
    struct path_brake brake;
    if (!brake_begin(&brake, at, numbers, search->period_s)) {
        return may_wait(search, at, numbers);
    }
    return keeping->surely || brake_keeps(search, keeping->inverse, &brake, at->s, row, FINE_S);
}

/* Feed overrides at which brakes are followed, and the same shares of the piece's greatest. */
static const double SHARES[] = {1.0,         511.0 / 512, 509.0 / 512, 504.0 / 512,
                                488.0 / 512, 448.0 / 512, 0.75,        320.0 / 512,
                                0.5,         0.25,        0.1};
#define SHARE_COUNT ((uint32_t)(sizeof SHARES / sizeof SHARES[0]))

/* Feed override number r = 0 ... 2 SHARE_COUNT - 1 of a piece. */
static double override_at(const struct piece *piece, uint32_t r)
{
    return r < SHARE_COUNT ? SHARES[r] : piece->factor * SHARES[r - SHARE_COUNT];
}

/* The state at an instant and override; a rise of the override adds `little` to the acceleration at most. Returns 0 for a state
 * that there is not. */
static int overridden_state(const struct piece *piece, const struct overridden *which,
                            double little, struct state *from)
{
    const double rate = override_at(piece, which->rate);
    if ((which->rate >= SHARE_COUNT && rate <= 1.0) ||
        (which->slope > 0 && rate >= piece->factor)) {
        return 0;
    }
    *from = piece->at[which->instant];
    const double change = slope_at(piece, rate, which->slope) * from->v;
    const double more = which->slope < 0 ? -change : which->slope > 0 ? fmin(change, little) : 0.0;
    from->a = rate * rate * from->a + more;
    from->v *= rate;
    return 1;
}

/* A quarter of the deceleration. */
static double quarter(const struct search *search, const struct path_brake_numbers *numbers)
{
    return 0.25 * (double)numbers->deceleration_q56 * 0x1p-56 /
           (search->period_s * search->period_s);
}

/* Whether a brake out of this state fits and keeps the limits, or need not fit; 1 for a state that there is not. */
static int overridden_keeps(const struct search *search, const struct piece *piece,
                            const struct keeping *keeping, const struct overridden *which,
                            const struct path_brake_numbers *numbers)
{
    const double little = search->rise_is_cut ? quarter(search, numbers) : HUGE_VAL;
    const uint32_t row = piece->row[which->instant];
    struct state from;
    if (!overridden_state(piece, which, little, &from)) {
        return 1;
    }
    return (!keeping->surely &&
            strain(search, keeping->inverse, &search->rows[row], &from, 0.0) > 1.0) ||
           state_keeps(search, keeping, &from, row, numbers);
}

/* The same limits at other feed overrides, also while the override changes. */
static int overrides_keep(const struct search *search, struct piece *piece,
                          const struct keeping *keeping, const struct path_brake_numbers *numbers)
{
    struct overridden which = piece->suspect_override;
    for (uint32_t n = 0; n < piece->count; n++) {
        for (which.rate = 0; which.rate < 2u * SHARE_COUNT; which.rate++) {
            for (which.slope = -1; which.slope <= 1; which.slope++) {
                if (!overridden_keeps(search, piece, keeping, &which, numbers)) {
                    piece->suspect_override = which;
                    return 0;
                }
            }
        }
        which.instant = which.instant + 1u < piece->count ? which.instant + 1u : 0u;
    }
    return 1;
}

/* The same at the rate 1 from instants close to each other. */
static int close_keep(const struct search *search, struct piece *close,
                      const struct path_brake_numbers *numbers, const struct extent *extent)
{
    const struct keeping keeping = {&search->inverse,
                                    extent_keeps(search, &search->inverse, extent)};
    for (uint32_t n = 0; n < close->count; n++) {
        uint32_t i = (n + close->suspect) % close->count;
        if (!state_keeps(search, &keeping, &close->at[i], close->row[i], numbers)) {
            close->suspect = i;
            return 0;
        }
    }
    return 1;
}

/* Whether a brake out of one that has begun at this state with the numbers `before` keeps the limits. */
static int out_of_brake_keeps(const struct search *search, const struct state *from, uint32_t row,
                              const struct path_brake_numbers *before,
                              const struct path_brake_numbers *numbers)
{
    struct path_brake first;
    struct path_brake second;
    if (!brake_begin(&first, from, before, search->period_s)) {
        return 1;
    }
    path_brake_first(&first);
    for (uint32_t k = 1; !path_brake_rests(&first); k++) {
        if (k % BRAKE_EACH == 0u && path_brake_begin(&second, &first.at, numbers) &&
            !brake_keeps(search, &search->at_any_rate, &second, from->s, row, FINE_S)) {
            return 0;
        }
        path_brake_step(&first);
    }
    return 1;
}

/* From one instant and override. A feed hold first cuts a rise. */
static int out_of_overridden_keeps(const struct search *search, const struct piece *piece,
                                   const struct overridden *which,
                                   const struct path_brake_numbers *before,
                                   const struct path_brake_numbers *numbers)
{
    struct state from;
    return !overridden_state(piece, which, quarter(search, before), &from) ||
           out_of_brake_keeps(search, &from, piece->row[which->instant], before, numbers);
}

/* From some instants, at all overrides, also while the override changes; the one that broke a limit last is looked at first. */
static int brakes_keep(const struct search *search, struct piece *piece, const int codes[3])
{
    struct path_brake_numbers numbers;
    struct path_brake_numbers before;
    struct overridden which = {0, 0, 0};
    if (piece->before[1] == 0 || !numbers_of(search, piece->before, &before)) {
        return 1;
    }
    if (!numbers_of(search, codes, &numbers) ||
        !out_of_overridden_keeps(search, piece, &piece->suspect_before, &before, &numbers)) {
        return 0;
    }
    const uint32_t each = 1u + piece->count / BRAKE_INSTANTS;
    for (; which.instant < piece->count; which.instant += each) {
        for (which.rate = 0; which.rate < 2u * SHARE_COUNT; which.rate++) {
            for (which.slope = -1; which.slope <= 1; which.slope++) {
                if (!out_of_overridden_keeps(search, piece, &which, &before, &numbers)) {
                    piece->suspect_before = which;
                    return 0;
                }
            }
        }
    }
    return 1;
}

static int within(const struct piece *piece, const int codes[3])
{
    for (int k = 0; k < 3; k++) {
        if (codes[k] < 1 || codes[k] < piece->most[k] - FEWER || codes[k] > piece->most[k]) {
            return 0;
        }
    }
    return 1;
}

struct choice {
    int codes[3];
    double cost_s, longest_s, mean_s, worst_s, first_s;
};

/* Whether a brake keeps the limits in the state in which other codes broke one last. Most codes that break one do so there. */
static int suspect_keeps(const struct search *search, const struct piece *piece,
                         const struct path_brake_numbers *numbers)
{
    const struct keeping keeping = {&search->at_any_rate, 0};
    return overridden_keeps(search, piece, &keeping, &piece->suspect_override, numbers);
}

static int strictly(const struct search *search, struct piece *piece, const int codes[3])
{
    const struct inverse *inverse = &search->at_any_rate;
    struct path_brake_numbers numbers;
    struct extent extent;
    if (!numbers_of(search, codes, &numbers) || !suspect_keeps(search, piece, &numbers)) {
        return 0;
    }
    piece_extent(search, piece, &numbers, &extent);
    const struct keeping keeping = {inverse, extent_keeps(search, inverse, &extent)};
    return close_keep(search, piece->close, &numbers, &extent) &&
           overrides_keep(search, piece, &keeping, &numbers) && brakes_keep(search, piece, codes);
}

/* Takes the codes when they are better; `strict`: at all rates, and at more instants. */
static int better(const struct search *search, struct piece *piece, const int codes[3],
                  double after_s, int strict, struct choice *best)
{
    struct path_brake_numbers numbers;
    struct times times;
    if (!within(piece, codes) || !numbers_of(search, codes, &numbers)) {
        return 0;
    }
    if ((strict && !suspect_keeps(search, piece, &numbers)) ||
        !times_of(search, piece, &numbers, after_s, &times) || times.cost_s >= best->cost_s ||
        !all_keep(search, piece, &times, &numbers) || (strict && !strictly(search, piece, codes))) {
        return 0;
    }
    memcpy(best->codes, codes, sizeof best->codes);
    best->cost_s = times.cost_s;
    best->longest_s = times.longest_s;
    best->mean_s = times.mean_s;
    best->worst_s = times.worst_s;
    best->first_s = times.first_s;
    return 1;
}

static void climb(const struct search *search, struct piece *piece, double after_s, int strict,
                  int first, struct choice *best)
{
    static const int8_t ways[][3] = {{1, 1, 1},  {0, 1, 0},  {0, 0, 1},  {1, 0, 0},  {0, 1, 1},
                                     {1, 1, 0},  {1, 0, 1},  {1, -1, 0}, {-1, 1, 0}, {0, 1, -1},
                                     {0, -1, 1}, {1, 0, -1}, {-1, 0, 1}};
    for (int step = first; step >= 1; step /= 2) {
        for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
            int codes[3];
            int taken = 1;
            while (taken) {
                for (int k = 0; k < 3; k++) {
                    codes[k] = best->codes[k] + step * ways[i][k];
                    codes[k] = codes[k] > piece->most[k] && ways[i][k] > 0 &&
                                       best->codes[k] < piece->most[k]
                                   ? piece->most[k]
                                   : codes[k];
                }
                taken = better(search, piece, codes, after_s, strict, best);
            }
        }
    }
}

/* Lowers all codes until the limits are kept at all rates; 0: they never are. */
static int lowered(const struct search *search, struct piece *piece, const int start[3],
                   double after_s, struct choice *best)
{
    for (int down = 0; down <= GREATEST_CODE; down += down < 32 ? 2 : 8) {
        int codes[3];
        for (int k = 0; k < 3; k++) {
            codes[k] = start[k] - down;
        }
        best->cost_s = NEVER_S;
        if (!within(piece, codes)) {
            return 0;
        }
        if (better(search, piece, codes, after_s, 1, best)) {
            return 1;
        }
    }
    return 0;
}

/* Starting points all over the codes. */
static void scan(const struct search *search, struct piece *piece, double after_s, int strict,
                 struct choice *best)
{
    for (int a = 0; a <= FEWER; a += 6) {
        for (int j1 = 0; j1 <= FEWER; j1 += 6) {
            for (int j2 = 0; j2 <= FEWER; j2 += 6) {
                int codes[3] = {piece->most[0] - j1, piece->most[1] - a, piece->most[2] - j2};
                (void)better(search, piece, codes, after_s, strict, best);
            }
        }
    }
}

/* Cost of the greatest codes, whatever limits they break. */
static double least_time(const struct search *search, const struct piece *piece, double after_s)
{
    struct path_brake_numbers numbers;
    struct times times;
    return numbers_of(search, piece->most, &numbers) &&
                   times_of(search, piece, &numbers, after_s, &times)
               ? times.cost_s
               : 0.0;
}

static void search_piece(const struct search *search, struct piece *piece, const int warm[3],
                         double after_s, struct choice *best)
{
    const struct choice none = {{0, 0, 0}, NEVER_S, NEVER_S, NEVER_S, NEVER_S, NEVER_S};
    struct choice rough = none;
    (void)better(search, piece, piece->most, after_s, 0, &rough);
    int near[3];
    for (int k = 0; k < 3; k++) {
        near[k] = warm[k] < piece->most[k] ? warm[k] : piece->most[k];
    }
    (void)better(search, piece, near, after_s, 0, &rough);
    if (rough.cost_s < NEVER_S) {
        climb(search, piece, after_s, 0, 4, &rough);
    }
    if (rough.cost_s > NEAR * least_time(search, piece, after_s)) {
        scan(search, piece, after_s, 0, &rough);
    }
    *best = none;
    if (rough.cost_s < NEVER_S || lowered(search, piece, piece->most, after_s, &rough)) {
        climb(search, piece, after_s, 0, 8, &rough);
        if (strictly(search, piece, rough.codes)) {
            *best = rough;
            return;
        }
        if (!lowered(search, piece, rough.codes, after_s, best) &&
            !lowered(search, piece, piece->most, after_s, best)) {
            *best = none;
        }
    }
    if (best->cost_s >= NEVER_S) {
        scan(search, piece, after_s, 1, best);
    }
    if (best->cost_s < NEVER_S) {
        climb(search, piece, after_s, 1, 4, best);
    }
}

/* Takes codes that keep the limits strictly, each less than the greatest by its share of `down` quarters; 0: they do not. */
static int lower_by(const struct search *search, struct piece *piece, const int from[3],
                    const int quarters[3], double after_s, struct choice *best)
{
    int codes[3];
    for (int k = 0; k < 3; k++) {
        codes[k] = from[k] - quarters[k] / 4;
    }
    return better(search, piece, codes, after_s, 1, best);
}

/* A search of few trials: the codes of the next piece, else lower ones of all, or of the onset first, down to the lowest; then
 * raised together as far as that goes. */
static void search_quickly(const struct search *search, struct piece *piece, const int warm[3],
                           double after_s, struct choice *best)
{
    static const int8_t shapes[][3] = {{4, 4, 4}, {4, 2, 0}, {4, 0, 0}, {2, 4, 4}};
    const struct choice none = {{0, 0, 0}, NEVER_S, NEVER_S, NEVER_S, NEVER_S, NEVER_S};
    int near[3];
    for (int k = 0; k < 3; k++) {
        near[k] = warm[k] < piece->most[k] ? warm[k] : piece->most[k];
    }
    *best = none;
    int found = better(search, piece, near, after_s, 1, best);
    for (int down = 0; down <= FEWER && !found; down += 4) {
        for (size_t i = 0; i < sizeof shapes / sizeof shapes[0] && !found; i++) {
            const int quarters[3] = {down * shapes[i][0], down * shapes[i][1], down * shapes[i][2]};
            found = lower_by(search, piece, piece->most, quarters, after_s, best);
        }
    }
    for (int step = found ? 4 : 0; step >= 1; step /= 2) {
        int raised = 1;
        while (raised) {
            const int quarters[3] = {-4 * step, -4 * step, -4 * step};
            const int from[3] = {best->codes[0], best->codes[1], best->codes[2]};
            raised = lower_by(search, piece, from, quarters, after_s, best);
        }
    }
}

/* --- All of it --- */

static void invert(struct inverse *inverse, const struct stop_limits *limits, uint32_t axis_count)
{
    inverse->feed = 1.0 - FEED_ROUNDING;
    for (uint32_t k = 0; k < axis_count; k++) {
        inverse->velocity[k] = over(limits->axis_velocity[k]);
        inverse->axis_acceleration[k] = over(limits->axis_acceleration[k]);
        inverse->axis_jerk[k] = over(limits->axis_jerk[k]);
        inverse->reach[k] = over(limits->reach[k]);
        inverse->time_constant[k] = limits->time_constant[k];
    }
}

static void begin(struct search *search, const struct program *p, const struct stop_limits *limits,
                  const struct stop_path *path)
{
    search->axis_count = p->header.axis_count;
    search->rows = path->rows;
    search->bends = path->bends;
    search->row_count = p->header.segment_count * STOP_ROWS;
    const struct stop_stretch *group = path->groups;
    search->levels = 0;
    for (uint32_t count = search->row_count >> GROUP_BITS; count > 0; count >>= GROUP_BITS) {
        search->group[search->levels++] = group;
        group += count;
    }
    search->period_us = p->header.period_us;
    search->period_s = 1e-6 * p->header.period_us;
    search->length_mm = ldexp((double)p->header.length_q40_mm, -40);
    search->rise_is_cut = limits->rise_is_cut;
    search->quick = limits->quick;
    search->deceleration = limits->acceleration;
    invert(&search->inverse, limits, search->axis_count);
    search->at_any_rate = search->inverse;
    search->at_any_rate.feed /= 1.0 + FASTER;
    for (uint32_t k = 0; k < search->axis_count; k++) {
        search->at_any_rate.velocity[k] /= 1.0 + FASTER;
        search->at_any_rate.reach[k] *= limits->reach_at_pace != 0u ? 0.0 : 1.0;
    }
    for (int k = 0; k < 3; k++) {
        const double *axis = k == 1 ? limits->axis_acceleration : limits->axis_jerk;
        double all = hypot(axis[0], axis[1]);
        all = search->axis_count > PROGRAM_PLANE ? hypot(all, axis[2]) : all;
        double limit = fmin(k == 1 ? limits->acceleration : limits->jerk, all);
        search->most[k] = 0;
        for (int c = 1; c <= GREATEST_CODE; c++) {
            search->most[k] = number_of(k, c) <= limit ? c : search->most[k];
        }
    }
}

/* A piece without a brake: the plan goes on into the next. */
static void wait_for_next(const struct piece *piece, double after_s, struct choice *out)
{
    double seconds = piece->seconds;
    memset(out, 0, sizeof *out);
    out->first_s = out->worst_s = after_s + seconds;
    out->mean_s = after_s + 0.5 * seconds;
}

/* Codes that are given. */
static void known_choice(const struct search *search, const struct piece *piece,
                         const struct stop_found *found, double after_s, struct choice *out)
{
    struct path_brake_numbers numbers;
    struct times times;
    wait_for_next(piece, after_s, out);
    if (found->codes[1] == 0u) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        out->codes[k] = found->codes[k];
    }
    if (!numbers_of(search, out->codes, &numbers) ||
        !times_of(search, piece, &numbers, after_s, &times)) {
        return;
    }
    out->mean_s = times.mean_s;
    out->worst_s = times.worst_s;
    out->first_s = times.first_s;
}

/* The numbers of a piece, or none where waiting for the next is about as good. */
static void choose(const struct search *search, struct piece *piece, const int warm[3],
                   double after_s, struct choice *best)
{
    struct choice none;
    if (search->quick != 0u) {
        search_quickly(search, piece, warm, after_s, best);
    } else {
        search_piece(search, piece, warm, after_s, best);
    }
    wait_for_next(piece, after_s, &none);
    if (none.mean_s < WAIT_BETTER * best->mean_s ||
        (none.mean_s < WAIT_AS_GOOD * best->mean_s && best->longest_s > 2.0 * none.worst_s)) {
        *best = none;
    }
}

void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found)
{
    struct search search;
    struct piece piece;
    struct piece close;
    double after_s = 0.0;
    double left_s = 0.0;
    begin(&search, p, limits, path);
    int warm[3] = {search.most[0], search.most[1], search.most[2]};
    for (uint32_t i = p->header.piece_count; i > 0; i--) {
        struct choice best;
        piece_look(&search, p, i - 1u, left_s, INSTANT_S, &piece);
        if (found[i - 1u].known != 0u) {
            known_choice(&search, &piece, &found[i - 1u], after_s, &best);
        } else {
            piece_look(&search, p, i - 1u, left_s, CLOSE_S, &close);
            for (int k = 0; k < 3; k++) {
                piece.before[k] = found[i - 1u].before[k];
            }
            piece.close = &close;
            choose(&search, &piece, warm, after_s, &best);
        }
        for (int k = 0; k < 3; k++) {
            found[i - 1u].codes[k] = (uint8_t)best.codes[k];
            warm[k] = best.codes[k] > 0 ? best.codes[k] : warm[k];
        }
        found[i - 1u].worst_s = best.worst_s;
        found[i - 1u].mean_s = best.mean_s;
        after_s = best.first_s;
        left_s += piece.seconds;
    }
}

static void most_of(double *most, double value)
{
    *most = greater(*most, fabs(value));
}

void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used)
{
    struct search search;
    begin(&search, p, limits, path);
    memset(used, 0, sizeof *used);
    for (uint32_t i = 0; i < p->header.piece_count; i++) {
        struct program_piece from;
        double c[8];
        program_piece_get(p, i, &from);
        double seconds = piece_powers(&from, c);
        int parts = (int)fmin(greater(ceil(seconds / INSTANT_S), 4.0), 256.0);
        for (int k = 0; k <= parts; k++) {
            double u = BESIDE + (1.0 - 2.0 * BESIDE) * k / parts; /* jerks jump at joints */
            struct state at = {piece_value(c, u, 0), piece_value(c, u, 1) / seconds,
                               piece_value(c, u, 2) / (seconds * seconds)};
            double j = piece_value(c, u, 3) / (seconds * seconds * seconds);
            const struct stop_row *row = &search.rows[row_at(&search, at.s)];
            struct axes axes;
            axes_of(&search, row, share_of(row, at.s), &at, j, &axes);
            most_of(&used->feed, at.v);
            most_of(&used->acceleration, at.a);
            most_of(&used->jerk, j);
            most_of(&used->centripetal, row->curvature * at.v * at.v);
            for (uint32_t axis = 0; axis < search.axis_count; axis++) {
                most_of(&used->axis_velocity[axis], axes.velocity[axis]);
                most_of(&used->axis_acceleration[axis], axes.acceleration[axis]);
                most_of(&used->axis_jerk[axis], axes.jerk[axis]);
                most_of(&used->reach[axis], axes.velocity[axis] + limits->time_constant[axis] *
                                                                      axes.acceleration[axis]);
            }
        }
    }
}
