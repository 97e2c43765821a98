/* SPDX-License-Identifier: MIT */
/*
 * brake_check: proves that path stops keep the limits of the path axes (velocity, acceleration, jerk): a stop that
 * begins at any instant of a feed piece, at any feed override that the override bounds allow, at every instant until
 * standstill. docs/guides/limits.md describes what is proved and what is not. Used by `hodograph verify` through
 * host_tools/hodograph/native; a controller does not call it. Changes only its struct; no I/O.
 *
 * All path stops that may begin in a part of a piece are followed at once. At each time there are lower and upper
 * bounds of arc length, speed, acceleration and jerk. They follow from the law of core/path_brake (docs/theory/feed.md
 * section 7). core/path_bounds gives bounds of the motion of the axes on that stretch of the path. If these bounds do
 * not decide, the part is halved: in time, override or override rate. A fault stop that begins during a feed hold is
 * not checked.
 *
 * Integers only (core/real.h): the same verdict on every target. Main loop of a host; no heap, some 9 KiB of stack and
 * 10^6 to 10^9 instructions for each piece (docs/guides/limits.md section 5).
 */
#ifndef HODOGRAPH_CORE_BRAKE_CHECK_H
#define HODOGRAPH_CORE_BRAKE_CHECK_H

#include "core/path_bounds.h"
#include "core/program.h"
#include "core/program_rules.h"

/* Contents private, except `evaluations`. */
struct brake_check {
    struct path_bounds bounds;
    struct motion limit;
    const struct program_limits *limits;
    struct real period_s;
    int any;                   /* 1: an axis has a limit */
    uint32_t hint;             /* segment at the start of the piece */
    uint32_t evaluations;      /* parts of path stops that the last call has evaluated, */
    uint32_t most_evaluations; /* and the number at which it refuses */
};

/* For a program that keeps the other rules of program_check. */
void brake_check_begin(struct brake_check *check, const struct program *p,
                       const struct program_limits *limits);

/* One piece and kind of stop with these stop parameters. Pieces in any order. Returns 1 if the stops are proved, or if
 * none begins in the piece; 0 if a limit is exceeded, or if the proof cannot decide. */
int brake_check_piece(struct brake_check *check, uint32_t piece, enum program_stop_kind kind,
                      const struct program_stop *stop);

#endif
