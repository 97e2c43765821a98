/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_usage.h (see there): the limit usage of a motion along a path. Used by offline/stop_brake,
 * offline/stop_verdict and offline/stop_search. Pure functions, any thread of a host. */
#include "offline/stop_usage.h"

#include <math.h>

#define UNLIMITED_MM_S 1e12 /* stands for a feed without limit */
/* share of a limit that bounds of a whole path stop leave free: rounding to whole ticks takes less */
#define SPARE_SHARE   1e-4
#define FEED_ROUNDING 1e-9 /* share of a feed by which the plan may exceed it */

static double over(double limit)
{
    return 1.0 / (limit * (1.0 - STOP_MARGIN)); /* of HUGE_VAL 0 */
}

void stop_invert(struct stop_inverse *inverse, const struct stop_limits *limits,
                 uint32_t axis_count)
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

static void planar_axes_of(const struct stop_row *low, double share, const struct stop_state *at,
                           double j, struct stop_axes *out)
{
    const struct stop_row *high = low + 1;
    double kappa = stop_between(low->curvature, high->curvature, share);
    double slope = stop_between(low->slope, high->slope, share);
    double normal = kappa * at->v * at->v;
    double jerk_along = j - kappa * normal * at->v;
    double jerk_across = (3.0 * kappa * at->a + slope * at->v * at->v) * at->v;
    double tx = stop_between(low->tangent[0], high->tangent[0], share);
    double ty = stop_between(low->tangent[1], high->tangent[1], share);
    out->velocity[0] = at->v * tx;
    out->velocity[1] = at->v * ty;
    out->acceleration[0] = at->a * tx - normal * ty;
    out->acceleration[1] = at->a * ty + normal * tx;
    out->jerk[0] = jerk_along * tx - jerk_across * ty;
    out->jerk[1] = jerk_along * ty + jerk_across * tx;
}

static void spatial_axes_of(const struct stop_lookup *lookup, const struct stop_row *low,
                            double share, const struct stop_state *at, double j,
                            struct stop_axes *out)
{
    const struct stop_bend *bend = &lookup->bends[low - lookup->rows];
    for (uint32_t k = 0; k < lookup->axis_count; k++) {
        double first = stop_between(bend[0].by_mm[0][k], bend[1].by_mm[0][k], share);
        double second = stop_between(bend[0].by_mm[1][k], bend[1].by_mm[1][k], share);
        double third = stop_between(bend[0].by_mm[2][k], bend[1].by_mm[2][k], share);
        out->velocity[k] = at->v * first;
        out->acceleration[k] = at->a * first + at->v * at->v * second;
        out->jerk[k] = j * first + at->v * (3.0 * at->a * second + at->v * at->v * third);
    }
}

void stop_axes_of(const struct stop_lookup *lookup, const struct stop_row *low, double share,
                  const struct stop_state *at, double j, struct stop_axes *out)
{
    if (lookup->axis_count == PROGRAM_PLANE) {
        planar_axes_of(low, share, at, j, out);
    } else {
        spatial_axes_of(lookup, low, share, at, j, out);
    }
}

double stop_share_of(const struct stop_row *low, double s)
{
    double way = low[1].s_mm - low->s_mm;
    double share = way > 0.0 ? (s - low->s_mm) / way : 1.0;
    return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
}

double stop_usage(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                  const struct stop_row *low, const struct stop_state *at, double j)
{
    struct stop_axes axes;
    double share = stop_share_of(low, at->s);
    stop_axes_of(lookup, low, share, at, j, &axes);
    double most = at->v * inverse->feed / stop_between(low->feed_mm_s, low[1].feed_mm_s, share);
    most = low->feed_mm_s < UNLIMITED_MM_S && low[1].feed_mm_s < UNLIMITED_MM_S ? most : 0.0;
    for (uint32_t k = 0; k < lookup->axis_count; k++) {
        most = stop_greater(most, fabs(axes.velocity[k]) * inverse->velocity[k]);
        most = stop_greater(most, fabs(axes.acceleration[k]) * inverse->axis_acceleration[k]);
        most = stop_greater(most, fabs(axes.jerk[k]) * inverse->axis_jerk[k]);
        double pull = axes.velocity[k] + inverse->time_constant[k] * axes.acceleration[k];
        most = stop_greater(most, fabs(pull) * inverse->reach[k]);
    }
    return most;
}

/* Share of the limits that axes use at most with these bounds. */
static double axis_share(const struct stop_inverse *inverse, uint32_t k, double velocity,
                         double acceleration, double jerk)
{
    double most = velocity * inverse->velocity[k];
    most = stop_greater(most, acceleration * inverse->axis_acceleration[k]);
    most = stop_greater(most, jerk * inverse->axis_jerk[k]);
    return stop_greater(most,
                        (velocity + inverse->time_constant[k] * acceleration) * inverse->reach[k]);
}

/* sqrt instead of hypot: the values stay far below 1e150, so that no square overflows. */
static double length_of(double along, double across)
{
    return sqrt(along * along + across * across);
}

/* Greatest component along an axis, if the component of the tangent along it is at most this one. */
static double component(double along, double across, double tangent)
{
    return stop_lesser(length_of(along, across), along * tangent + across);
}

/* Acceleration and jerk along the path and across it, at most. */
struct parts {
    double normal, jerk_along, jerk_across;
};

static struct parts parts_of(const struct stop_extent *extent)
{
    const struct stop_stretch *path = &extent->path;
    const double normal = path->curvature * extent->speed * extent->speed;
    const double bent = path->slope * extent->speed * extent->speed;
    const struct parts out = {
        .normal = normal,
        .jerk_along = extent->jerk + path->curvature * normal * extent->speed,
        .jerk_across = (3.0 * path->curvature * extent->acceleration + bent) * extent->speed,
    };
    return out;
}

static double planar_share(const struct stop_inverse *inverse, const struct stop_extent *extent)
{
    const struct parts parts = parts_of(extent);
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_PLANE; k++) {
        const double tangent = extent->path.tangent[k];
        const double acceleration = component(extent->acceleration, parts.normal, tangent);
        const double jerk = component(parts.jerk_along, parts.jerk_across, tangent);
        most =
            stop_greater(most, axis_share(inverse, k, extent->speed * tangent, acceleration, jerk));
    }
    return most;
}

static double spatial_share(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                            const struct stop_extent *extent)
{
    const struct parts parts = parts_of(extent);
    const double acceleration = length_of(extent->acceleration, parts.normal);
    const double jerk = length_of(parts.jerk_along, parts.jerk_across);
    const double v = extent->speed;
    double most = 0.0;
    for (uint32_t k = 0; k < lookup->axis_count; k++) {
        const double first = extent->path.bend.by_mm[0][k];
        const double second = extent->path.bend.by_mm[1][k];
        const double third = extent->path.bend.by_mm[2][k];
        double own = extent->acceleration * first + v * v * second;
        double own_jerk =
            extent->jerk * first + v * (3.0 * extent->acceleration * second + v * v * third);
        if (k < PROGRAM_SPACE) { /* a component is no more than the whole */
            own = stop_lesser(own, acceleration);
            own_jerk = stop_lesser(own_jerk, jerk);
        }
        most = stop_greater(most, axis_share(inverse, k, v * first, own, own_jerk));
    }
    return most;
}

int stop_extent_keeps(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                      const struct stop_extent *extent)
{
    const double along = extent->speed * inverse->feed / extent->path.feed_mm_s;
    const double axes = lookup->axis_count == PROGRAM_PLANE
                            ? planar_share(inverse, extent)
                            : spatial_share(lookup, inverse, extent);
    return stop_greater(along, axes) * (1.0 + SPARE_SHARE) <= 1.0;
}

/* The same for a path of this row alone: 0 for a row means 0 for each stretch that has it. */
static int row_keeps(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                     struct stop_extent *extent, uint32_t row)
{
    stop_stretch_of_row(lookup, row, &extent->path);
    return stop_extent_keeps(lookup, inverse, extent);
}

int stop_keeps_up_to(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                     struct stop_extent *extent, uint32_t row, double to_mm)
{
    /* If a limit is exceeded, the first row alone usually shows it, or one that did so before. */
    if (!row_keeps(lookup, inverse, extent, row)) {
        return 0;
    }
    uint32_t *sharp = lookup->last->sharp;
    for (int k = 0; k < 2; k++) {
        if (sharp[k] > row && lookup->rows[sharp[k]].s_mm <= to_mm &&
            !row_keeps(lookup, inverse, extent, sharp[k])) {
            return 0;
        }
    }
    stop_stretch_from(lookup, row, to_mm, &extent->path);
    const int keeps = stop_extent_keeps(lookup, inverse, extent);
    if (!keeps) {
        sharp[0] = extent->path.bending;
        sharp[1] = extent->path.bent == sharp[0] ? 0u : extent->path.bent;
    }
    return keeps;
}
