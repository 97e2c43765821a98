/* SPDX-License-Identifier: MIT */
/*
 * The rate of program time (lambda) and its way from one rest to another: the second difference is constant within a
 * tick, so the rate is piecewise quadratic and program time piecewise cubic in time. Derivation: docs/theory/numerics.md
 * section 12, "Feed override".
 *
 * Units: rate in 2^-57, its slope in 2^-56 a tick, its second difference in 2^-56 a tick squared. A tick that takes the
 * slope from a to b raises the rate by exactly a + b units. Pure functions, integers only, no loop. Tick context.
 */
#ifndef HODOGRAPH_CORE_RATE_H
#define HODOGRAPH_CORE_RATE_H

#include <stdint.h>

#include "core/rate_pace.h"

#define RATE_MOST (2 * RATE_ONE)

struct rate {
    int64_t rate_q57; /* 0 ... RATE_MOST */
    int64_t slope_q56;
};

/* How long a way from rest to rest takes: the slope rises for `rise` ticks, at most for `half`; it is `half` ticks from
 * the first to where it begins to fall, and falls as it rose. rise + half ticks in all. */
struct rate_ticks {
    uint32_t rise;
    uint32_t half;
};

/* Ticks for a way (0 ... RATE_MOST): as few as can be, but for 2^-10 of them and two. */
void rate_ticks_of(struct rate_ticks *ticks, const struct rate_pace *pace, int64_t way_q57);

/* What the slope changes by in a tick, floor(way / (2 rise half)): inside the bounds that `ticks` was made with, for
 * that way and any shorter one. What it leaves of the way is below 2 rise half units. */
int64_t rate_step_of(const struct rate_ticks *ticks, int64_t way_q57);

/* Upper bound of the program time of so many ticks at this mean rate, 2^-32 s; period rounded up. */
uint64_t rate_span_q32(const struct rate_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s);

/* A way that the rate is on. All zero but `rest`: at rest. */
struct rate_move {
    int64_t step_q56; /* signed */
    int64_t rest_q57; /* where the rate would come to rest if the move were cut now */
    uint32_t rise;    /* ticks left of each */
    uint32_t even;
    uint32_t fall; /* of what has risen so far */
};

void rate_move_begin(struct rate_move *move, const struct rate *from,
                     const struct rate_ticks *ticks, int64_t step_q56);

/* Comes to rest before the end, if it would have an even slope for long. Before the first tick. */
void rate_move_shorten(struct rate_move *move);

/* Brings the slope to 0 from now on, as fast as it rose. */
void rate_move_cut(struct rate_move *move);

static inline int rate_moves(const struct rate_move *move)
{
    return (move->rise | move->even | move->fall) != 0u;
}

/* Slope at the end of the next tick, which has this one at its begin. */
int64_t rate_move_slope(struct rate_move *move, int64_t slope_q56);

/* One tick that ends with this slope. */
static inline void rate_tick(struct rate *rate, int64_t slope_q56)
{
    rate->rate_q57 += rate->slope_q56 + slope_q56;
    rate->slope_q56 = slope_q56;
}

#endif
