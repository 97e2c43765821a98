/* SPDX-License-Identifier: MIT */
/*
 * stop_usage: the limit usage of a motion along a path; above 1 a limit is exceeded. Used by offline/stop_brake,
 * offline/stop_verdict and offline/stop_search.
 *
 * There are two computations: the exact usage in a state (stop_usage), and bounds for all states of a stretch of the
 * path at once (stop_extent_keeps), which cost as much as one state. If the bounds show that a limit is kept, no state
 * exceeds it. mm, s. Pure functions, any thread of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_USAGE_H
#define HODOGRAPH_OFFLINE_STOP_USAGE_H

#include "core/program.h"
#include "offline/stop_limits.h"
#include "offline/stop_path.h"

/* Reciprocals of the axis limits, each limit reduced by STOP_MARGIN. 0: no limit. `time_constant` is the exception: it
 * belongs to `reach` and is in s. */
struct stop_inverse {
    double feed; /* the feed is multiplied by this before it is compared with the path's feed */
    double velocity[PROGRAM_AXES], axis_acceleration[PROGRAM_AXES], axis_jerk[PROGRAM_AXES],
        reach[PROGRAM_AXES], time_constant[PROGRAM_AXES];
};

/* A state along the path: arc length, speed, acceleration. */
struct stop_state {
    double s, v, a;
};

/* The motion of the axes: velocity, acceleration, jerk by axis. */
struct stop_axes {
    double velocity[PROGRAM_AXES], acceleration[PROGRAM_AXES], jerk[PROGRAM_AXES];
};

/* Upper bounds of the motion of a path stop, and of the path on its braking distance. */
struct stop_extent {
    double speed, acceleration, jerk;
    struct stop_stretch path;
};

/* Fills `inverse` from the limits of axis_count axes. */
void stop_invert(struct stop_inverse *inverse, const struct stop_limits *limits,
                 uint32_t axis_count);

/* Share, 0 ... 1, of the distance from a row to the next at which an arc length lies. */
double stop_share_of(const struct stop_row *low, double s);

/* The motion of the axes at a share of the distance from row `low` to the next, with a jerk j along the path. */
void stop_axes_of(const struct stop_lookup *lookup, const struct stop_row *low, double share,
                  const struct stop_state *at, double j, struct stop_axes *out);

/* The greatest share of a limit that a state with the jerk j uses; `low`: the last row at or before it. */
double stop_usage(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                  const struct stop_row *low, const struct stop_state *at, double j);

/* 1: no state within these bounds exceeds a limit. */
int stop_extent_keeps(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                      const struct stop_extent *extent);

/* 1: no limit is exceeded on the path between a row and an arc length. `extent` has the bounds of the motion there, and
 * gets those of the path. */
int stop_keeps_up_to(const struct stop_lookup *lookup, const struct stop_inverse *inverse,
                     struct stop_extent *extent, uint32_t row, double to_mm);

#endif
