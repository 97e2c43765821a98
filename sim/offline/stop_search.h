/* SPDX-License-Identifier: MIT */
/*
 * The numbers of a stop: for each feed piece of a program the jerk, deceleration and jerk (codes of
 * docs/reference/protocol.md 1.4) with which a brake along the path may begin anywhere in the piece and keeps given
 * limits all the way to rest.
 *
 * Each brake is followed in double arithmetic from a grid of instants of the piece; limits are kept less STOP_MARGIN,
 * for what lies between the instants. Derivation: docs/theory/numerics.md section 7. No heap: the caller lends all
 * arrays. Main loop of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_SEARCH_H
#define HODOGRAPH_OFFLINE_STOP_SEARCH_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_limits.h"
#include "offline/stop_path.h"

/* What was found for a piece. The caller sets all up to `start`. Codes of 0: no numbers keep the limits from all of its
 * instants. */
struct stop_found {
    uint8_t known; /* 1: `codes` are given, and stay */
    uint8_t kept;  /* 1: `codes` are given, and stay if they keep the limits out of `before` too */
    uint8_t before[3]; /* codes of a brake out of which this one may begin; 0: none */
    uint8_t start[3];  /* codes that the search tries first; 0: those of the next piece */
    uint8_t codes[3];  /* jerk, deceleration, jerk */
    double worst_s;    /* longest brake of the instants looked at at the rate 1, */
    double mean_s;     /* and their mean */
};

/* How far the program itself uses the limits at the rate 1: greatest value of each, limit by limit, in `used`
 * (same fields; zones and time constants as in limits). */
void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used);

/* Searches those of piece_count results that are not known. Linear: about 0.2 ms a piece far from all limits,
 * some 5 ms a piece that uses them. */
void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found);

#endif
