/* SPDX-License-Identifier: MIT */
/*
 * A brake along the path: how feed hold, stop and fault stop come to rest without leaving the curve.
 *
 * The path speed follows an S-curve from the speed and acceleration that the motion has (docs/numerics.md section 12, "The
 * brake"): jerk down for n1 ticks until the deceleration is A', this deceleration for n2 ticks, jerk up for n3 ticks until
 * speed and acceleration are 0 in the same instant. n1, n2 and n3 are the least whole ticks for which both jerks and A' keep
 * the three numbers that the program's stop table has for the piece (core/program.h). Only the arc length is made here; the
 * point on the curve is the interpolator's (interp_at_arc_length).
 *
 * Unit of length: 2^-56 mm. Unit of time: a tick. Integers only, the same on every target. Speed and acceleration are 0
 * exactly at the end; the arc length has no rounding on the way. Its first speed differs from the motion's
 * by at most 3 (n1^2 + n3 (n1 + 2 n2 + n3)) units. Pure functions, bounded time, any context.
 */
#ifndef HODOGRAPH_CORE_PATH_BRAKE_H
#define HODOGRAPH_CORE_PATH_BRAKE_H

#include <stdint.h>

#include "core/program.h"

#define PATH_BRAKE_MOST_TICKS 4095u              /* of each of the three parts */
#define PATH_BRAKE_MOST_SPEED ((int64_t)1 << 61) /* 32 mm a tick */
#define PATH_BRAKE_NO_SPEED   ((int64_t)1 << 16) /* 2^-40 mm a tick: below it the path rests */

/* A place on the path and how it is passed. */
struct path_state {
    int64_t arc_length_q40_mm; /* rounded down, */
    uint32_t fine_q56_mm;      /* and what that leaves: below 2^16 */
    int64_t speed_q56;         /* mm a tick */
    int64_t acceleration_q56;  /* mm a tick squared */
};

/* What a brake may use, all above 0; jerks in mm a tick cubed, deceleration in mm a tick squared. */
struct path_brake_numbers {
    int64_t jerk_down_q56;
    int64_t deceleration_q56;
    int64_t jerk_up_q56;
};

/* Contents private but for `at`, the state at the last tick. All ticks 0: at rest. */
struct path_brake {
    struct path_state at;
    int64_t down_q56; /* a sixth of the jerk of the first part, by which the acceleration falls, */
    int64_t up_q56;   /* and of the last, by which it rises: a tick goes whole units */
    uint32_t first;   /* ticks left */
    uint32_t second;
    uint32_t last;
};

/* The numbers of an entry of the stop table, rounded down. period_us: 1000, 2000, 4000 or 8000. Returns 1, or 0 where the
 * entry has no brake (then *out is unchanged). */
int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us);

/* The brake from a state. Returns 1, or 0 where none fits, *brake then being unchanged: speed below PATH_BRAKE_NO_SPEED or
 * above PATH_BRAKE_MOST_SPEED; an acceleration so negative that the speed would pass 0; a part that would take more than
 * PATH_BRAKE_MOST_TICKS. Begins with the next step. */
int path_brake_plan(struct path_brake *brake, const struct path_state *from,
                    const struct path_brake_numbers *numbers);

/* One tick on; `at` is the state then. At rest nothing changes. */
void path_brake_step(struct path_brake *brake);

/* Ticks until rest. */
static inline uint32_t path_brake_ticks(const struct path_brake *brake)
{
    return brake->first + brake->second + brake->last;
}

/* Way until rest, of a brake of which no step has been taken: within 2^-15 mm. */
int64_t path_brake_way_q40_mm(const struct path_brake *brake);

#endif
