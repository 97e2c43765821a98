/* SPDX-License-Identifier: MIT */
/*
 * A brake along the path: how feed hold, stop and fault stop come to rest without leaving the curve.
 *
 * The path speed follows an S-curve from the speed and acceleration that the motion has: the acceleration falls by at
 * most the first jerk to the deceleration, stays there, and rises by at most the last jerk until speed and acceleration
 * are 0 in the same tick. Jerks and deceleration are the three numbers that the program's stop table has for the piece
 * (core/program.h). Each tick decides from the state alone whether the acceleration still falls or the release phase
 * begins (docs/theory/numerics.md section 12, "Path stop"), so there is no plan to search for, and the numbers may
 * change on the way. Only the arc length is made here; the point on the curve is the interpolator's
 * (interpolator_at_arc_length).
 *
 * Unit of length: 2^-56 mm. Unit of time: a tick. Integers only, the same on every target. Speed and acceleration are 0
 * exactly at the end. Pure functions, bounded time, any context.
 */
#ifndef HODOGRAPH_CORE_PATH_BRAKE_H
#define HODOGRAPH_CORE_PATH_BRAKE_H

#include <stdint.h>

#include "core/program.h"

#define PATH_BRAKE_MOST_TICKS 4096u              /* of each of its parts */
#define PATH_BRAKE_MOST_SPEED ((int64_t)1 << 60) /* 16 mm a tick */
#define PATH_BRAKE_NO_SPEED   ((int64_t)1 << 16) /* 2^-40 mm a tick: below it the path rests */

/* A place on the path and how it is passed. */
struct path_state {
    int64_t arc_length_q40_mm; /* rounded down, */
    uint32_t fine_q56_mm;      /* and what that leaves: below 2^16 */
    int64_t speed_q56;         /* mm a tick */
    int64_t acceleration_q56;  /* mm a tick squared */
};

/* What a brake may use; jerks in mm a tick cubed, deceleration in mm a tick squared. At least 2^22, and the
 * deceleration below PATH_BRAKE_MOST_TICKS times either jerk: as path_brake_numbers_of makes them. */
struct path_brake_numbers {
    int64_t jerk_down_q56;
    int64_t deceleration_q56;
    int64_t jerk_up_q56;
};

/* Contents private but for `at`, the state at the last tick. */
struct path_brake {
    struct path_state at;
    struct path_brake_numbers numbers;
    int64_t rise_q56;      /* on the way to rest: a sixth of the jerk of the next tick, */
    int64_t rise_less_q56; /* by how much each tick has less of it, */
    uint32_t settle_ticks; /* and how many ticks are left */
    uint32_t phase;
};

/* The numbers of an entry of the stop table, rounded down. period_us: 1000, 2000, 4000 or 8000. Returns 1, or 0 where
 * the entry has no brake, or one out of range (then *out is unchanged). */
int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us);

/* The brake from a state, or with other numbers from where one is. Returns 1, or 0 where none fits, *brake then being
 * unchanged: speed below PATH_BRAKE_NO_SPEED or above PATH_BRAKE_MOST_SPEED; an acceleration so negative that the speed
 * would pass 0; more than PATH_BRAKE_MOST_TICKS. Begins with the next step. */
int path_brake_begin(struct path_brake *brake, const struct path_state *from,
                     const struct path_brake_numbers *numbers);

/* Whether a brake that begins here, its first tick in place of a step or not, comes to rest within a distance. It
 * compares an upper bound of the stopping distance, one tick of the speed above it on the mean, so the result may be 0
 * although the brake would just fit. */
int path_brake_fits(const struct path_state *from, const struct path_brake_numbers *numbers,
                    int64_t distance_q40_mm);

/* The first tick of a brake may be this one, in place of a step: an acceleration above 0 falls, as far as 0, and one
 * below stays. Cheap, for a tick that had to determine the state. */
void path_brake_first(struct path_brake *brake);

/* One tick on; `at` is the state then. At rest nothing changes. */
void path_brake_step(struct path_brake *brake);

/* 1 when speed and acceleration are 0. */
int path_brake_rests(const struct path_brake *brake);

#endif
