/* SPDX-License-Identifier: MIT */
/*
 * Program time, tick by tick: the program runs at rate 1 until it ends or until a controlled stop
 * brings the rate to 0 along a jerk-limited curve (docs/numerics.md section 12, "Stopping").
 *
 * At rate 1 tick k is at min(k period, duration), without drift, in two resolutions:
 * q42: floor(k period_us 2^42 / 10^6 + 1/2), what a tick uses, and q32 likewise, what the
 * dictionary shows. Integers only, the same on every target. One owner: begin, and stop called from
 * elsewhere than the tick, need the tick held off.
 */
#ifndef HODOGRAPH_CORE_TIMEBASE_H
#define HODOGRAPH_CORE_TIMEBASE_H

#include <stdint.h>

#include "core/program.h"

enum timebase_state {
    TIMEBASE_RUNNING = 0,
    TIMEBASE_STOPPING = 1, /* the rate goes from 1 to 0 */
    TIMEBASE_STOPPED = 2,  /* rate 0, time stands still before the end */
    TIMEBASE_ENDED = 3, /* time has reached the duration: the last step was the exact end point */
};

/* Contents private: use the functions. */
struct timebase {
    uint64_t duration_q42_s;
    uint64_t time_q42_s;   /* of the last step, rounded down */
    uint32_t rest;         /* and what it leaves, in 1/15625 of 2^-42 s */
    uint64_t period_q42_s; /* rounded down */
    uint32_t period_rest;
    uint32_t period_q38_s; /* rounded, for the stop */
    uint32_t started;      /* 0 until the first step */
    uint32_t state;        /* enum timebase_state */
    /* The stop, in ticks: lambda'' is -1, 0, +1 over corner, flat, corner; slope = corner + flat */
    uint32_t slope_ticks;
    uint32_t corner_ticks;
    uint64_t unit_q62; /* 2^62 / (6 slope corner) */
    uint32_t ramp_tick;
    uint32_t rate_q30; /* mean rate of the last step */
};

/* Sets up for a checked program at time 0, running. period_us: 1000, 2000, 4000 or 8000. Reads all
 * pieces for the tightest override bounds: main loop only. */
void timebase_begin(struct timebase *tb, const struct program *p, uint32_t period_us);

/* Asks for a controlled stop; takes effect from the next step. Without effect when not running. The
 * rate falls to 0 within the tightest override_rate and override_second_rate of the program's
 * pieces (a stop that would take more than 2^20 ticks is made in so many). When the program ends
 * first, it ends. */
void timebase_stop(struct timebase *tb);

/* Goes to the next setpoint and gives its program time in 2^-32 s, rounded to nearest; the first
 * call after begin gives 0. After the end it stays at the duration, after a stop where the stop
 * ended. Constant time, tick context. */
uint64_t timebase_step(struct timebase *tb);

/* Program time of the last step in 2^-42 s, rounded to nearest: for interp_at_q42. */
uint64_t timebase_time_q42(const struct timebase *tb);

/* Mean rate of program time in the last step, 2^30 = 1: the feed on the path is rate times the feed
 * of the interpolated point. */
uint32_t timebase_rate_q30(const struct timebase *tb);

enum timebase_state timebase_state(const struct timebase *tb);

#endif
