/* SPDX-License-Identifier: MIT */
/*
 * Program time, tick by tick, and everything that changes its rate: feed hold, resume, override 0
 * to 200 %, controlled stop, and a start from rest anywhere in the program.
 *
 * Only the rate changes, so the tool never leaves the curve. It moves along jerk-limited curves
 * inside the override bounds of every feed piece that a transition touches (docs/reference/protocol.md 1.3):
 * acceleration and jerk on the path stay inside the controller's limits at any instant, for any
 * sequence of commands (docs/theory/numerics.md section 12, "Feed override").
 *
 * At rate 1 tick k is at min(k period, duration), without drift, in two resolutions: q42:
 * floor(k period_us 2^42 / 10^6 + 1/2), what a tick uses, and q32 likewise, what the dictionary
 * shows. Integers only, the same on every target. One owner: commands called from elsewhere than
 * the tick need the tick held off. No heap; about 0.3 KiB.
 */
#ifndef HODOGRAPH_CORE_TIMEBASE_H
#define HODOGRAPH_CORE_TIMEBASE_H

#include <stdint.h>

#include "core/prepared.h"
#include "core/program.h"
#include "core/rate.h"
#include "core/rate_plan.h"

enum timebase_state {
    TIMEBASE_RUNNING = 0,  /* at the override, or on the way to it; also with an override of 0 */
    TIMEBASE_STOPPING = 1, /* the rate goes to 0, for good */
    TIMEBASE_STOPPED = 2,  /* rate 0, time stands still before the end */
    TIMEBASE_ENDED = 3,   /* time has reached the duration: the last step was the exact end point */
    TIMEBASE_HOLDING = 4, /* the rate goes to 0 until resumed */
    TIMEBASE_HELD = 5,    /* rate 0 until resumed */
};

#define TIMEBASE_MOST_PERCENT 200u

/* Contents private: use the functions. */
struct timebase {
    const struct program *program;
    uint64_t duration_q42_s;
    uint64_t time_q42_s;   /* of the last step, rounded down */
    uint32_t rest;         /* and what it leaves: in 1/15625 of 2^-42 s, by ticks at rate 1, */
    uint32_t fine;         /* and in 2^-62 s, by all others; each below 2^-42 s */
    uint64_t period_q42_s; /* rounded down */
    uint32_t period_rest;
    uint32_t period_us;
    uint32_t period_log2;                /* of the period in ms */
    uint32_t period_q32_s;               /* rounded up, for look-ahead */
    uint32_t started;                    /* 0 until the first step */
    uint64_t sixth_q70_s;                /* a sixth of the period */
    uint32_t state;                      /* enum timebase_state */
    uint32_t piece;                      /* of the last step, */
    const struct prepared_piece *record; /* its record, if there are any, */
    uint64_t piece_end_q42_s;            /* and its end: of the last piece the duration */
    uint32_t steady; /* 1: at the rate wanted, in which nothing but a command changes anything */
    uint32_t saturated;
    uint64_t even_q62_s; /* at rest, at a rate other than 1: program time of a tick */
    struct rate now;
    int64_t override_q57;
    int64_t least_q57;             /* least factor of all pieces */
    struct program_override least; /* all their bounds */
    struct rate_plan plan;
};

/* Sets up for a checked program at time 0, running, override 100 %. period_us: 1000, 2000, 4000 or
 * 8000. Reads all pieces for the tightest bounds: main loop only. The program must stay as it is
 * while the timebase is used. */
void timebase_begin(struct timebase *tb, const struct program *p, uint32_t period_us);

/* The same, but from rest at this program time (program_time_at_q42), from where the rate rises
 * like after a hold. Main loop. */
void timebase_begin_at(struct timebase *tb, const struct program *p, uint32_t period_us,
                       uint64_t time_q42_s);

/* --- Commands: take effect from the next step; when a change of mind cannot be made safely at once
 * (the next pieces allow less), the transition under way goes on first. Any sequence is allowed.
 * Constant time. --- */

/* To rate 0 and stay there until resumed. Without effect when stopping, stopped, ended. */
void timebase_hold(struct timebase *tb);

/* Back to the override. Without effect when not holding or held. */
void timebase_resume(struct timebase *tb);

/* Rate wanted, in per cent; more than 200 counts as 200. Kept while held. */
void timebase_override(struct timebase *tb, uint32_t percent);

/* To rate 0 and to an end there: final. When the program ends first, it ends. */
void timebase_stop(struct timebase *tb);

/* --- Tick --- */

/* A rate that rises stops to: its slope goes to 0 as fast as it rose. Tick context. */
void timebase_rise_no_more(struct timebase *tb);

/* From rest again, at a time in this piece (its record, or NULL): the rate rises from there to the override. The fields
 * are those of a struct interp_search. */
void timebase_go_from(struct timebase *tb, uint64_t time_q42_s, uint32_t piece,
                      const struct prepared_piece *record, uint64_t piece_end_q32_s);

/* Goes to the next setpoint and gives its program time in 2^-32 s, rounded to nearest; the first
 * call after begin gives the time begun at. After the end it stays at the duration, after a stop
 * where the stop ended. Bounded time, tick context. */
uint64_t timebase_step(struct timebase *tb);

/* The same, and gives timebase_time_q42: what a tick needs. */
uint64_t timebase_step_q42(struct timebase *tb);

/* Program time of the last step in 2^-42 s, rounded to nearest: for interp_at_q42. */
uint64_t timebase_time_q42(const struct timebase *tb);

/* Rate at the last step, 2^30 = 1: the feed on the path is rate times the feed of the interpolated
 * point. 0 once stopped or ended. */
uint32_t timebase_rate_q30(const struct timebase *tb);

/* 1 while the override wanted is more than the pieces allow here, so that the rate stays below. */
int timebase_saturated(const struct timebase *tb);

enum timebase_state timebase_state(const struct timebase *tb);

#endif
