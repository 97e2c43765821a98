/* SPDX-License-Identifier: MIT */
/*
 * stop_search: searches the stop parameters of each feed piece of a program. These are three codes: jerk of onset,
 * deceleration and jerk of release (docs/reference/protocol.md 1.4). A path stop with them may begin anywhere in the
 * piece and keeps given limits until standstill. Called by host_tools/hodograph/native.
 *
 * The search simulates path stops from a grid of instants of the piece, in double arithmetic. It reduces the limits by
 * STOP_MARGIN, as a reserve for the motion between the instants. Derivation: docs/theory/feed.md section 7. No heap:
 * the caller provides all arrays. Any thread; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_SEARCH_H
#define HODOGRAPH_OFFLINE_STOP_SEARCH_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_limits.h"
#include "offline/stop_path.h"

/* Input and result for a piece. The caller sets `known`, `kept`, `before` and `start`, and `codes` if they are given.
 * The search sets `codes`, `worst_s` and `mean_s`. Codes of 0: a stop waits for the next piece, because no codes keep
 * the limits or because waiting is better (WAIT_BETTER and WAIT_AS_GOOD in stop_search.c). */
struct stop_found {
    uint8_t known;     /* 1: `codes` are given, and stay */
    uint8_t kept;      /* 1: the same, but only if stops that replace `before` keep the limits */
    uint8_t before[3]; /* codes of a path stop that this one may replace; 0: none */
    uint8_t start[3];  /* codes to try first; 0: those of the nearest later piece with codes */
    uint8_t codes[3];  /* jerk of onset, deceleration, jerk of release */
    double worst_s;    /* longest time to standstill from the sampled instants, at override 1 */
    double mean_s;     /* mean of these times */
};

/* Writes the greatest value of each limited quantity in the nominal motion to `used`, in the field that has its limit
 * in `limits`. `reach` is computed with the time constants of `limits`. All other fields of `used` become 0. */
void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used);

/* Searches the codes of the elements of `found` (piece_count) that are not known, and computes the times of all. A
 * piece far from all limits takes about 0.2 ms, a piece at a limit some 5 ms; with limits->quick about 0.1 ms. */
void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found);

#endif
