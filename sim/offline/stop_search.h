/* SPDX-License-Identifier: MIT */
/*
 * The numbers of a stop: for each feed piece of a program the jerk, deceleration and jerk (codes of docs/reference/protocol.md
 * 1.4) with which a brake along the path may begin anywhere in the piece and keeps given limits all the way to rest.
 *
 * Each brake is followed in double arithmetic from a grid of instants of the piece; limits are kept less STOP_MARGIN,
 * for what lies between the instants. Derivation: docs/theory/numerics.md section 7. No heap: the caller lends all arrays.
 * Main loop of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_SEARCH_H
#define HODOGRAPH_OFFLINE_STOP_SEARCH_H

#include <stdint.h>

#include "core/program.h"

#define STOP_ROWS   33u   /* of the path, for each segment */
#define STOP_MARGIN 0.003 /* share of each limit */

/* The path at an arc length, ascending; two rows with one arc length where segments meet. */
struct stop_row {
    double s_mm;
    double tangent[2]; /* of a planar program */
    double curvature;  /* 1/mm; of a spatial program without sign */
    double slope;      /* of the curvature, 1/mm^2; of a planar program */
    double feed_mm_s;  /* greatest feed here: caps and centripetal acceleration */
};

/* How the axes of a spatial program move there: first to third derivative by arc length. */
struct stop_bend {
    double by_mm[3][PROGRAM_AXES];
};

/* The greatest magnitudes on a stretch of the path, and its least feed. */
struct stop_stretch {
    double curvature;
    double slope;
    double tangent[2];
    double feed_mm_s;
    struct stop_bend bend;
};

/* The path of a program: segment_count * STOP_ROWS rows and bends. */
struct stop_path {
    struct stop_row *rows;
    struct stop_bend *bends; /* of a spatial program; not looked at of a planar one */
    struct stop_stretch
        *groups; /* stop_groups() of 8, 64, 512, ... rows: bounds of a long stretch are quick */
};

/* A greatest feed on a stretch of the path. */
struct stop_cap {
    double from_mm;
    double to_mm;
    double feed_mm_s;
};

/* What a brake has to keep; HUGE_VAL: no limit. The numbers never ask for more than `acceleration` and `jerk`. */
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
    const struct stop_cap *caps;
    uint32_t cap_count;
    uint32_t
        reach_at_pace; /* 1: `reach` counts at the rate 1 only: other rates may pass it without a brake */
    uint32_t
        rise_is_cut; /* 1: a brake begins when a rising rate adds a quarter of its deceleration at most */
    uint32_t quick; /* 1: few codes are tried, about 0.1 ms a piece, for long programs */
};

/* What was found for a piece. Codes of 0: no numbers keep the limits from all of its instants. */
struct stop_found {
    uint8_t known;     /* set by the caller. 1: the codes are given, and stay; */
    uint8_t before[3]; /* and codes of a brake out of which this one may begin, 0: none */
    uint8_t codes[3];  /* jerk, deceleration, jerk */
    double worst_s;    /* longest brake of the instants looked at at the rate 1, */
    double mean_s;     /* and their mean */
};

/* How many groups of rows the path of a program has: `groups` of its stop_path. */
uint32_t stop_groups(uint32_t segment_count);

/* Fills the path; the program has passed program_open. */
void stop_rows(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path);

/* How far the program itself uses the limits at the rate 1: greatest value of each, limit by limit, in `used`
 * (same fields; caps and time constants as in limits). */
void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used);

/* Searches those of piece_count results that are not known. Linear: about 0.2 ms a piece far from all limits,
 * some 5 ms a piece that uses them. */
void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found);

#endif
