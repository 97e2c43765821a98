/* SPDX-License-Identifier: MIT */
/*
 * Program time, tick by tick: the program runs at rate 1 until it ends or until a controlled stop
 * brings the rate to 0 along a jerk-limited curve (docs/numerics.md section 12, "Stopping").
 *
 * While the rate is 1, tick k is at exactly round(k * period_us * 2^32 / 10^6) in 2^-32 s: no drift.
 * Integers only, deterministic on every target. One owner: begin and stop may be called from
 * the main loop only while the tick cannot interrupt (or from the tick itself).
 */
#ifndef HODOGRAPH_CORE_TIMEBASE_H
#define HODOGRAPH_CORE_TIMEBASE_H

#include <stdint.h>

#include "core/program.h"

enum timebase_state {
    TIMEBASE_RUNNING = 0,
    TIMEBASE_STOPPING = 1,
    TIMEBASE_STOPPED = 2, /* rate 0, time stands still before the end */
    TIMEBASE_ENDED = 3,   /* time has reached the duration: the last tick was the exact end point */
};

struct timebase {
    uint64_t duration_q32_s;
    uint64_t time_q32_s; /* of the last tick */
    uint32_t step_q32_s; /* whole part of a period ... */
    uint32_t step_rest;  /* ... and its rest in 1/15625 */
    uint32_t rest;
    uint32_t tick;
    uint32_t state;      /* enum timebase_state */
    /* tightest bounds over the program's pieces, for the stop */
    uint32_t rate_limit_q16_per_s;
    uint32_t second_limit_q8_per_s2;
    uint32_t rate_q30;   /* present rate of program time, 2^30 = 1 */
    uint32_t period_us;
    uint32_t ramp_tick;
    uint32_t ramp_ticks;
};

/* Sets up for a checked program at time 0, running. period_us as in the program's header (1000,
 * 2000, 4000 or 8000). Reads all pieces once for the tightest override bounds: main loop only. */
void timebase_begin(struct timebase *tb, const struct program *p, uint32_t period_us);

/* Asks for a controlled stop; takes effect from the next step. Without effect when not running. */
void timebase_stop(struct timebase *tb);

/* Program time of the next setpoint in 2^-32 s; the first call after begin gives 0. After the end it stays at
 * the duration, after a stop where the stop ended. Constant time, tick context. */
uint64_t timebase_step(struct timebase *tb);

enum timebase_state timebase_state(const struct timebase *tb);

#endif
