/* SPDX-License-Identifier: MIT */
/*
 * The stop table of a program (docs/protocol.md 1.4): how long a stop can take, and whether the table says so. Nothing in
 * the image is believed: the bounds follow from the feed pieces, the override bounds and the numbers alone
 * (docs/numerics.md section 7, "Stops"). Integer arithmetic; every value is rounded so that a bound is never too short.
 *
 * The table is gone through from the last piece to the first, since a stop that cannot brake in a piece goes on into the
 * next. About 3000 instructions per piece and kind. Main loop.
 */
#ifndef HODOGRAPH_CORE_STOP_CHECK_H
#define HODOGRAPH_CORE_STOP_CHECK_H

#include <stdint.h>

#include "core/program.h"
#include "core/program_check.h"

/* Ticks of a stop that are not in the continuous curve: until the command takes effect and its brake is planned, and the
 * rounding of its three parts. */
#define STOP_TICKS 6u
/* Time in which the piece whose numbers count may still change, in periods of program time: three ticks at 200 %. */
#define STOP_WINDOW_TICKS 6u
#define STOP_WINDOW       8 /* pieces that begin in it, at most (docs/protocol.md 1.3: no two last less than two periods) */

/* From the command to rest, held at UINT32_MAX. */
struct stop_bound {
    uint32_t time_us;
    uint32_t way_um;
};

/* Contents private. */
struct stop_walk {
    const struct program *program;
    enum program_stop_kind kind;
    uint64_t window_q32_s;
    struct stop_bound own[STOP_WINDOW];     /* of the pieces behind, the nearest first, */
    uint64_t duration_q32_s[STOP_WINDOW];   /* and their durations */
    struct stop_bound next;                 /* bound of the piece behind */
    uint32_t count;
};

/* Begins behind the last piece of a program whose pieces and segments have passed their checks. */
void stop_walk_begin(struct stop_walk *walk, const struct program *p, enum program_stop_kind kind);

/* The bound of the piece before: the first call gives that of the last piece, and so on. */
struct stop_bound stop_walk_back(struct stop_walk *walk, uint32_t piece);

/* Checks the table against limits. Returns 0 or the code of a broken rule; *index is its piece. */
int stop_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

#endif
