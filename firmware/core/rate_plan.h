/* SPDX-License-Identifier: MIT */
/*
 * Where the rate goes next: one decision for a whole way from rest to rest, spread over the ticks before it, with a way to
 * a safe rest always at hand; part of the timebase. docs/theory/numerics.md section 12, "Override ramps". Tick context,
 * bounded time.
 */
#ifndef HODOGRAPH_CORE_RATE_PLAN_H
#define HODOGRAPH_CORE_RATE_PLAN_H

#include <stdint.h>

#include "core/rate.h"

struct timebase;

enum rate_task { RATE_TASK_NONE, RATE_TASK_SEARCH, RATE_TASK_BEGIN };

enum rate_kind {
    RATE_SETTLE, /* at or below the least factor of the program: where it rests, it may rest for ever */
    RATE_LEAVE, /* from above it to below it */
    RATE_STAY,  /* no move: how long the present rate above it may last */
    RATE_CLIMB, /* to a rate above it */
};

struct rate_plan {
    struct rate_move move;
    uint32_t task;           /* what the next tick at rest does, enum rate_task */
    uint32_t kind;           /* of the move that is on its way or looked for */
    uint32_t window;         /* looked at next */
    uint32_t searched;       /* last search above the least factor began in this piece */
    int64_t wanted_q57;      /* what it is all for */
    int64_t target_q57;      /* what is looked for, */
    int64_t goal_q57;        /* and the next rest on the way there */
    struct rate_ticks ticks; /* of the way there */
    /* At rest above the least factor: the way back is known, if it begins by then */
    uint64_t leave_q32_s;
    struct rate_ticks back;
};

/* For a new program; at rest. */
void rate_plan_reset(struct rate_plan *plan);

/* While the rate moves: slope at the end of the next tick. */
int64_t rate_plan_move(struct timebase *tb);

/* At rest: 1 when the rate is where it is wanted and may stay there whatever the pieces are. Then the next tick is like
 * this one, and what was planned is off. */
int rate_plan_steady(struct timebase *tb);

/* Where the rate rests next: its rest, if it falls to it. */
int64_t rate_plan_from(const struct timebase *tb);

/* At rest, and not steady: one step of deciding what to do next. Keeps `saturated` of *tb. */
void rate_plan_decide(struct timebase *tb);

/* For rate_search: no window will do for what it looked for, which was not to settle. */
void rate_plan_give_up(struct timebase *tb);

#endif
