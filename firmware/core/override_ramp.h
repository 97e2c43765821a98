/* SPDX-License-Identifier: MIT */
/*
 * override_ramp: ramps of the feed override from one constant value to another. Used by core/chunk, core/coefficients,
 * core/override_plan and core/program_clock.
 *
 * The override is the rate of program time (lambda of docs/theory/numerics.md section 12, "Feed override"); 1 is the
 * nominal motion. On a ramp its second derivative is constant in each tick, so the override is piecewise quadratic in
 * time. The feed pieces of a program bound its first two derivatives, for each level of the override
 * (docs/reference/protocol.md 1.3). A ramp keeps the bounds of the level of its greatest override. So a change through
 * several levels is made in stages (section 12, "Levels").
 *
 * Units: override in 2^-57, its slope in 2^-56 a tick, its second difference in 2^-56 a tick squared. A tick that takes
 * the slope from a to b raises the override by exactly a + b units. Pure functions, integers only, no division unless
 * stated. Any context.
 */
#ifndef HODOGRAPH_CORE_OVERRIDE_RAMP_H
#define HODOGRAPH_CORE_OVERRIDE_RAMP_H

#include <stdint.h>

#include "core/program.h"

#define OVERRIDE_ONE          ((int64_t)1 << 57)
#define OVERRIDE_MOST         (2 * OVERRIDE_ONE)
#define OVERRIDE_MOST_PERCENT 200u /* OVERRIDE_MOST in per cent */
/* 10^-6: the largest remainder of its change that a ramp leaves, unless its bounds are near the least of the format. */
#define OVERRIDE_SPARE ((int64_t)1 << 37)

/* A factor of the override bounds as an override. */
static inline int64_t override_of_factor(uint32_t factor_q14)
{
    return (int64_t)factor_q14 << 43;
}

struct override_state {
    int64_t override_q57; /* 0 ... OVERRIDE_MOST */
    int64_t slope_q56;
};

/* --- What the program allows --- */

/* Least of the bounds of the pieces first ... first + count - 1, as many of them as the program has; one at least. */
void override_bounds_of(struct program_override *out, const struct program *p, uint32_t first,
                        uint32_t count);

/* Look-ahead is by windows of 1, 2, 4, 8, 16 pieces. */
#define OVERRIDE_WINDOWS 5u

/* Number of pieces in a window. */
static inline uint32_t override_window_pieces(uint32_t window)
{
    return (uint32_t)1 << window;
}

/* Where the first stage of a change ends, and the level whose bounds hold until there. */
struct ramp_stage {
    int64_t end_q57;
    uint32_t level;
};

/* A change of the override, independent of bounds: its ends, and the levels of its first part and of its last. */
struct ramp_change {
    int64_t from_q57;
    int64_t to_q57;
    uint32_t first;
    uint32_t last;
};

void override_change_of(struct ramp_change *out, int64_t from_q57, int64_t to_q57);

/* The first stage of a change. Levels with nearly equal bounds count as one. */
void override_stage_of(struct ramp_stage *out, const struct program_override *bounds,
                       const struct ramp_change *change);

/* Bounds of a level as a tick uses them. With R and S the bounds of slope and second difference, in 2^-56 a tick and a
 * tick squared; R from 2^30, S from 2^28, both up to 2^56. */
struct ramp_limits {
    uint32_t rate_ticks;    /* at least R / S: ticks in which the slope reaches R */
    uint32_t inverse_slope; /* 2^61 / R, rounded up */
    uint32_t inverse_root;  /* 2^45 / sqrt(S), rounded up */
};

/* Limits of a level (codes above 0). period_log2: 0 ... 3 for a period of 1, 2, 4, 8 ms. */
void override_limits_of(struct ramp_limits *out, const struct program_override *bounds,
                        uint32_t level, uint32_t period_log2);

/* --- Duration --- */

/* Duration of a ramp in ticks: the slope rises for `rise` ticks and begins to fall after `half` ticks (rise <= half).
 * It falls as it rose: rise + half ticks in all. */
struct ramp_ticks {
    uint32_t rise;
    uint32_t half;
};

/* Ticks for a change (0 ... OVERRIDE_MOST): the least number, or up to 2^-10 of it and two more. */
void override_ticks_of(struct ramp_ticks *ticks, const struct ramp_limits *limits,
                       int64_t change_q57);

/* What the slope changes by in a tick, floor(change / (2 rise half)): inside the limits that `ticks` was made with, for
 * that change and any smaller one. The remainder of the change is below 2 rise half units. One division. */
int64_t override_step_of(const struct ramp_ticks *ticks, int64_t change_q57);

/* Upper bound of the program time of so many ticks at this mean override, 2^-32 s; period rounded up. */
uint64_t override_span_q32(const struct ramp_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s);

/* --- A ramp under way --- */

/* All zero but `end_q57`: the override is constant. */
struct override_ramp {
    int64_t step_q56; /* signed */
    int64_t end_q57;  /* the override after an early ramp end now */
    uint32_t rise;    /* ticks left of each part, */
    uint32_t even;
    uint32_t fall; /* as many as have risen up to now */
};

void override_ramp_begin(struct override_ramp *ramp, int64_t from_q57,
                         const struct ramp_ticks *ticks, int64_t step_q56);

/* Shortens a ramp with a long part of constant slope: it ends before its target. Before the first tick. */
void override_ramp_shorten(struct override_ramp *ramp);

/* Early ramp end: the slope falls to 0 from now on, as fast as it rose. */
void override_ramp_cut(struct override_ramp *ramp);

static inline int override_ramp_moves(const struct override_ramp *ramp)
{
    return (ramp->rise | ramp->even | ramp->fall) != 0u;
}

/* Slope at the end of the next tick, which has this one at its start. */
int64_t override_ramp_slope(struct override_ramp *ramp, int64_t slope_q56);

/* One tick that ends with this slope. */
static inline void override_tick(struct override_state *state, int64_t slope_q56)
{
    state->override_q57 += state->slope_q56 + slope_q56;
    state->slope_q56 = slope_q56;
}

#endif
