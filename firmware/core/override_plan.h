/* SPDX-License-Identifier: MIT */
/*
 * override_plan: decides which ramp comes next towards the commanded override, and executes it tick by tick. Used by
 * core/feed_override. Changes only its struct; no I/O.
 *
 * One ramp at a time is decided, between two constant overrides, by look-ahead into the feed pieces that it covers. The
 * decision is spread over the ticks before it, one step of a search in a tick. Up to `guaranteed_q57`, the override
 * that all pieces of the program allow, the override may stay constant for any time. Above it the return ramp, and the
 * time at which it has to begin, are known before a ramp up begins (docs/theory/numerics.md section 12, "Override
 * ramps" and "Look-ahead windows").
 *
 * Integers only, bounded time, no heap. One owner. Tick context, except override_plan_begin.
 */
#ifndef HODOGRAPH_CORE_OVERRIDE_PLAN_H
#define HODOGRAPH_CORE_OVERRIDE_PLAN_H

#include <stdint.h>

#include "core/coefficients.h"
#include "core/override_ramp.h"
#include "core/program_clock.h"

enum override_task {
    OVERRIDE_DECIDES, /* no search is under way */
    OVERRIDE_SEARCHES,
    OVERRIDE_BEGINS,
};

enum override_kind {
    OVERRIDE_SETTLE, /* a ramp that ends at or below guaranteed_q57 and begins there */
    OVERRIDE_RETURN, /* from above it to below it */
    OVERRIDE_STAY,   /* no ramp: how long the present override above it may last */
    OVERRIDE_CLIMB,  /* a ramp to an override above it */
};

/* The steps of a search, one in a tick. */
enum override_search {
    OVERRIDE_EVALUATES, /* what the next window of pieces allows, and the levels of the change */
    OVERRIDE_STAGES,    /* how far one ramp may go with these bounds */
    OVERRIDE_MEASURES,  /* how long that ramp takes */
    OVERRIDE_FITS,      /* whether it ends inside the window */
};

/* Look-ahead: the pieces from one on, as many as the window has, or to the end of the program. */
struct override_window {
    const struct program_override *bounds; /* least of all pieces in it */
    uint64_t end_q32_s;                    /* UINT64_MAX with the last piece */
};

/* Contents private, except `now` and `saturated`. */
struct override_plan {
    struct override_state now;
    uint32_t saturated; /* 1: the commanded override is more than the pieces allow here */
    uint32_t started;   /* 0 until the first tick */
    uint32_t steady;    /* 1: at the commanded override, in which only a command changes anything */
    uint32_t held;      /* 1: the override goes to 0 */
    int64_t requested_q57;              /* the override that the command requests, */
    int64_t most_q57;                   /* its largest value that counts, */
    int64_t commanded_q57;              /* and the lower one of both */
    int64_t guaranteed_q57;             /* greatest override that all pieces allow, */
    struct program_override guaranteed; /* and their least bounds */
    struct override_ramp ramp;
    uint32_t task;   /* of the next tick at rest, enum override_task */
    uint32_t kind;   /* of the ramp that is under way or searched, enum override_kind */
    uint32_t step;   /* of the search, enum override_search */
    uint32_t window; /* evaluated next, */
    struct override_window ahead; /* and the one evaluated last */
    struct program_override kept; /* its bounds, if their record is not there any more */
    uint32_t searched;            /* last search above guaranteed_q57 began in this piece */
    int64_t wanted_q57;           /* what the decision is made for: commanded, or 0 */
    int64_t target_q57;           /* the override that is searched, */
    struct ramp_change change;    /* the change to it from the next constant override, */
    struct ramp_stage stage;      /* the end of the next ramp of this change, */
    struct ramp_ticks ticks;      /* and its ticks */
    int64_t high_q57;             /* greatest override on it */
    uint64_t ends_q32_s; /* program time by which the last ramp found ends; UINT64_MAX: not known */
    uint64_t return_q32_s;  /* above guaranteed_q57: latest start of the return ramp, */
    struct ramp_ticks back; /* and its ticks */
};

/* For a program at standstill, commanded 100 %. Reads all pieces: main loop. */
void override_plan_begin(struct override_plan *plan, const struct program *p);

/* The same for the next program of a job, which begins at rest and has these least override bounds. The command stays.
 * Constant time. */
void override_plan_begin_next(struct override_plan *plan, const struct program_override *least);

/* Sets the largest commanded override that counts. Not lowered while the override is above. */
void override_plan_limit(struct override_plan *plan, int64_t most_q57);

/* 1 if no ramp reaches pieces that begin at this program time or later: the override is steady, or on a ramp that ends
 * before, and no search is under way. */
int override_plan_ends_by(const struct override_plan *plan, uint64_t time_q32_s);

/* The program of the next chunk takes over: it has these least bounds, and its program time is less by `shift`. Only at
 * a constant override, or if override_plan_ends_by accepts the time of its first new piece. */
void override_plan_carry(struct override_plan *plan, const struct program_override *least,
                         uint64_t shift_q32_s);

/* Copies what it needs of the present coefficient records, which may then be overwritten. */
void override_plan_forget_records(struct override_plan *plan);

/* A path stop has ended: the override continues from 0. */
void override_plan_restart(struct override_plan *plan);

/* --- Commands: take effect in the next tick, or when the ramp under way may end early. --- */

/* The commanded override, in per cent; more than OVERRIDE_MOST_PERCENT counts as that. */
void override_plan_set(struct override_plan *plan, uint32_t percent);

/* Hold: to override 0, until release. */
void override_plan_hold(struct override_plan *plan);
void override_plan_release(struct override_plan *plan);

/* Ends a rise of the override early: its slope falls to 0 as fast as it rose. */
void override_plan_end_rise(struct override_plan *plan);

/* --- Tick --- */

/* One tick: changes the override, and advances the clock. Gives program_clock_time_q42; the first call gives the time
 * of the start. There the path is at rest, so the override becomes the commanded one at once, but at most 1. */
uint64_t override_plan_tick(struct override_plan *plan, struct program_clock *clock);

/* Part of it: a tick that is not steady; also the first. */
void override_plan_change(struct override_plan *plan, struct program_clock *clock);

/* Part of it: one step of a search. */
void override_plan_search(struct override_plan *plan, const struct program_clock *clock);

/* The window of this number (below OVERRIDE_WINDOWS) from the present piece of the clock on. */
void override_window_get(struct override_window *w, const struct program_clock *clock,
                         uint32_t window);

#endif
