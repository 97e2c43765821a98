/* SPDX-License-Identifier: MIT */
/*
 * stop_limits: the limits that a path stop keeps: those of the path file and the machine for a feed hold, those of the
 * machine for a fault stop. Data only; set by Python (host_tools/hodograph/native). Used by offline/stop_path,
 * offline/stop_search, offline/stop_usage and host tools.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_LIMITS_H
#define HODOGRAPH_OFFLINE_STOP_LIMITS_H

#include <stdint.h>

#include "core/program.h"

/* share of each limit that is reserved for the motion between two sampled instants */
#define STOP_MARGIN 0.003

/* A feed zone: the greatest feed on a stretch of the path. */
struct stop_feed_zone {
    double from_mm;
    double to_mm;
    double feed_mm_s;
};

/* What a path stop has to keep; HUGE_VAL: no limit. Its stop parameters never exceed `acceleration` and `jerk`. */
struct stop_limits {
    double feed;         /* along the path: mm/s, */
    double acceleration; /* mm/s^2, */
    double jerk;         /* mm/s^3 */
    double centripetal;
    double axis_velocity[PROGRAM_AXES]; /* of the program's path axes */
    double axis_acceleration[PROGRAM_AXES];
    double axis_jerk[PROGRAM_AXES];
    double reach
        [PROGRAM_AXES]; /* greatest |velocity + time constant * acceleration| of the axis, mm/s */
    double time_constant[PROGRAM_AXES]; /* s */
    const struct stop_feed_zone *zones;
    uint32_t zone_count;
    /* 1: `reach` counts at override 1 only, because the motion at other overrides may exceed it without a path stop */
    uint32_t reach_at_rate_1;
    /* 1: a path stop begins only if a rising override adds at most a quarter of its deceleration */
    uint32_t rise_is_cut;
    uint32_t quick; /* 1: few codes are tried, about 0.1 ms for each piece, for long programs */
};

#endif
