/* SPDX-License-Identifier: MIT */
/*
 * path_brake: a path stop, by which feed hold, stop and fault stop reach standstill without leaving the curve. Used by
 * core/feed_override, and by sim/offline to search stop parameters.
 *
 * The path speed follows an S-curve from the present speed and acceleration: the acceleration falls by at most the
 * first jerk to the deceleration, stays there, and rises by at most the last jerk until speed and acceleration are 0 in
 * the same tick. Jerks and deceleration are the stop parameters of the piece, from the program's stop table
 * (core/program.h). Each tick decides from the state alone whether the acceleration still falls or the release phase
 * begins (docs/theory/numerics.md section 12, "Path stop"). So no plan has to be searched, and the stop parameters may
 * change during the path stop. This module computes the arc length; interpolator_at_arc_length computes the point on
 * the curve.
 *
 * Unit of length: 2^-56 mm. Unit of time: a tick. Integers only, the same on every target. Speed and acceleration are 0
 * exactly at the end. The functions change their struct only; bounded time, any context.
 */
#ifndef HODOGRAPH_CORE_PATH_BRAKE_H
#define HODOGRAPH_CORE_PATH_BRAKE_H

#include <stdint.h>

#include "core/program.h"

#define PATH_BRAKE_MOST_TICKS 4096u              /* of each of its parts */
#define PATH_BRAKE_MOST_SPEED ((int64_t)1 << 60) /* 16 mm a tick */
#define PATH_BRAKE_NO_SPEED   ((int64_t)1 << 16) /* 2^-40 mm a tick: less counts as standstill */

/* A place on the path, with speed and acceleration there. */
struct path_state {
    int64_t arc_length_q40_mm; /* rounded down, */
    uint32_t fine_q56_mm;      /* and the remainder, below 2^16 */
    int64_t speed_q56;         /* mm a tick */
    int64_t acceleration_q56;  /* mm a tick squared */
};

/* What a path stop may use; jerks in mm a tick cubed, deceleration in mm a tick squared. At least 2^22, and the
 * deceleration below PATH_BRAKE_MOST_TICKS times either jerk: as path_brake_numbers_of makes them. */
struct path_brake_numbers {
    int64_t jerk_down_q56;
    int64_t deceleration_q56;
    int64_t jerk_up_q56;
};

/* Contents private, except `at`, the state at the last tick. */
struct path_brake {
    struct path_state at;
    struct path_brake_numbers numbers;
    int64_t rise_q56;      /* release phase: a sixth of the jerk of the next tick, */
    int64_t rise_less_q56; /* its decrease from tick to tick, */
    uint32_t settle_ticks; /* and the remaining ticks */
    uint32_t phase;
};

/* The numbers of an entry of the stop table, rounded down. period_us: 1000, 2000, 4000 or 8000. Returns 1, or 0 if the
 * entry has no path stop, or numbers out of range (then *out is unchanged). */
int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us);

/* Begins a path stop from a state; also one with other numbers from the state of the present one. It acts with the next
 * step. Returns 1, or 0 if none fits (then *brake is unchanged): speed below PATH_BRAKE_NO_SPEED or above
 * PATH_BRAKE_MOST_SPEED; an acceleration so negative that the speed would pass 0; more than PATH_BRAKE_MOST_TICKS. */
int path_brake_begin(struct path_brake *brake, const struct path_state *from,
                     const struct path_brake_numbers *numbers);

/* Whether a path stop that begins here, with or without path_brake_first, ends within a distance. It compares an upper
 * bound of the braking distance, which is larger by the distance of one tick on average. So the result may be 0
 * although the path stop would just fit. */
int path_brake_fits(const struct path_state *from, const struct path_brake_numbers *numbers,
                    int64_t distance_q40_mm);

/* A cheap first tick in place of path_brake_step, for a tick that also had to determine the state: an acceleration
 * above 0 falls, at most to 0; one below 0 stays. */
void path_brake_first(struct path_brake *brake);

/* Advances `at` by one tick. At standstill nothing changes. */
void path_brake_step(struct path_brake *brake);

/* 1 when speed and acceleration are 0. */
int path_brake_ended(const struct path_brake *brake);

#endif
