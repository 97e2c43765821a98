/* SPDX-License-Identifier: MIT */
/*
 * stop_search: searches the stop parameters of a program: for each feed piece the jerk, deceleration and jerk (codes of
 * docs/reference/protocol.md 1.4) with which a path stop may begin anywhere in the piece and keeps given limits until
 * standstill. Called by host_tools/hodograph/native.
 *
 * Each brake is followed in double arithmetic from a grid of instants of the piece. Limits are reduced by STOP_MARGIN
 * for the motion between the instants. Derivation: docs/theory/feed.md section 7. No heap: the caller lends all
 * arrays. Any thread; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_SEARCH_H
#define HODOGRAPH_OFFLINE_STOP_SEARCH_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_limits.h"
#include "offline/stop_path.h"

/* The result for a piece. The caller sets the fields up to `start`. Codes of 0: no stop parameters keep the limits from
 * all of its instants. */
struct stop_found {
    uint8_t known; /* 1: `codes` are given, and stay */
    uint8_t
        kept; /* 1: `codes` are given, and stay if they keep the limits also when replacing the brake `before` */
    uint8_t before[3]; /* codes of a brake that this one may replace; 0: none */
    uint8_t start[3];  /* codes that the search tries first; 0: those of the next piece */
    uint8_t codes[3];  /* jerk, deceleration, jerk */
    double worst_s;    /* longest brake from the sampled instants at override 1, */
    double mean_s;     /* and their mean */
};

/* The greatest value of each limited quantity in the nominal motion, in `used` (same fields; feed zones and time
 * constants as in limits). */
void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used);

/* Searches those of the piece_count results that are not known. Linear: about 0.2 ms for a piece far from all limits,
 * some 5 ms for a piece at a limit. */
void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found);

#endif
