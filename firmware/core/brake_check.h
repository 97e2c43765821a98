/* SPDX-License-Identifier: MIT */
/*
 * brake_check: proves that path stops keep the limits of the path axes (velocity, acceleration, jerk), for every
 * instant of a feed piece at which one may begin, at every rate of program time that the override bounds allow, at
 * every instant until rest. docs/guides/limits.md says what is proved and what is not.
 *
 * The brakes that may begin in a part of a piece are followed together: at each time lower and upper bounds of arc
 * length, speed, acceleration and jerk, which follow from the law of core/path_brake (docs/theory/numerics.md section
 * 7), beside bounds of how the axes move on that stretch of the path (core/path_bounds). Where that leaves it open the
 * part is halved: in time, rate or slope of the rate. A fault stop that begins during the brake of a feed hold is not
 * looked at.
 *
 * Integers only (core/real.h): the same verdict on every target. Main loop of a host; no heap, some 9 KiB of stack and
 * 10^6 to 10^9 instructions a piece (docs/guides/limits.md section 5).
 */
#ifndef HODOGRAPH_CORE_BRAKE_CHECK_H
#define HODOGRAPH_CORE_BRAKE_CHECK_H

#include "core/path_bounds.h"
#include "core/program.h"
#include "core/program_rules.h"

/* Contents private, but for `evaluations`. */
struct brake_check {
    struct path_bounds bounds;
    struct motion limit;
    const struct program_limits *limits;
    struct real period_s;
    int any;                   /* 1: an axis has a limit */
    uint32_t hint;             /* segment at the begin of the piece */
    uint32_t evaluations;      /* at a stretch of a brake, for the piece of the last call, */
    uint32_t most_evaluations; /* and until it is refused */
};

/* For a program that keeps the other rules of program_check. */
void brake_check_begin(struct brake_check *check, const struct program *p,
                       const struct program_limits *limits);

/* One piece and kind with these numbers. Pieces in any order. Returns 1 when they are proved, or there is no brake; 0
 * when a limit is passed, or may be as far as is known. */
int brake_check_piece(struct brake_check *check, uint32_t piece, enum program_stop_kind kind,
                      const struct program_stop *stop);

#endif
