/* SPDX-License-Identifier: MIT */
/*
 * What holds of the plan of the rate before and behind every tick, `is_sound`: the rate is in [0, 2], so is where a move
 * ends, no slope is greater than a way, and what is looked for or about to begin can be. cbmc_plan.c shows it for ticks at
 * rest, with every command, and from the first tick on; docs/numerics.md section 15.4 argues it for ticks of a move.
 *
 * With d the step, f the ticks risen, r and e those of rise and of even slope that are left, the slope is d f, a cut would
 * raise the rate by d f^2, and what is still to come before the fall raises it by 4 d f r + 2 d r^2 + 2 d e (f + r) more:
 * three numbers of their own here.
 */
#ifndef HODOGRAPH_PLAN_IS_SOUND_H
#define HODOGRAPH_PLAN_IS_SOUND_H

#include "proof.h"
#include "override_contracts.h"

#include "core/override_ramp.c"
#include "core/override_plan.c"
#define climb search_climb
#include "core/override_plan.c"
#undef climb

/* --- What the plan stands on: override_contracts.h --- */

static int64_t begun_q57; /* the way that a step was made for */

void some_ticks(struct ramp_ticks *ticks, const struct ramp_limits *pace, int64_t way_q57)
{
    (void)pace;
    prove(IS_RATE(way_q57));
    ticks->rise = nondet_uint32();
    ticks->half = nondet_uint32();
    assume(IS_TICKS(ticks));
}

int64_t some_step(const struct ramp_ticks *ticks, int64_t way_q57)
{
    prove(IS_TICKS(ticks));
    prove(IS_RATE(way_q57));
    begun_q57 = way_q57;
    return any_between(0, way_q57 / 2);
}

uint64_t some_span(const struct ramp_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s)
{
    (void)period_q32_s;
    prove(IS_TICKS(ticks));
    prove(IS_RATE(mean_q57));
    uint64_t span = nondet_uint64();
    assume(span <= MOST_SPAN);
    return span;
}

/* Between both ends; a rest on the way is that of a level below 1. */
void some_stage(struct ramp_stage *out, const struct program_override *bounds, int64_t from_q57,
                int64_t to_q57)
{
    (void)bounds;
    prove(IS_RATE(from_q57) && IS_RATE(to_q57));
    out->level = nondet_uint32();
    out->goal_q57 = nondet_int64();
    assume(out->goal_q57 == to_q57 || out->goal_q57 < OVERRIDE_ONE);
    assume(IS_STAGE(out) && (from_q57 < to_q57 ? from_q57 <= out->goal_q57 && out->goal_q57 <= to_q57
                                               : to_q57 <= out->goal_q57 && out->goal_q57 <= from_q57));
}

void some_limits(struct ramp_limits *out, const struct program_override *bounds, uint32_t level,
               uint32_t period_log2)
{
    (void)bounds;
    (void)period_log2;
    prove(level < PROGRAM_LEVELS);
    assume(IS_LIMITS(out));
}

void some_window(struct override_window *w, const struct timebase *tb, uint32_t window)
{
    (void)tb;
    prove(window < OVERRIDE_WINDOWS);
    w->own.factor_q14 = (uint16_t)nondet_uint32();
    assume(IS_FACTOR(w->own.factor_q14));
    w->bounds = &w->own;
    w->end_q32_s = nondet_uint64();
}

/* --- A move --- */

struct way {
    int64_t slope; /* d f */
    int64_t fall;  /* d f^2 */
    int64_t ahead; /* what rise and even slope still add to where a cut would end */
};

static int along(int64_t a, int64_t step)
{
    return step < 0 ? a <= 0 : a >= 0;
}

static int64_t end_of(const struct timebase *tb, const struct way *way)
{
    return tb->now.override_q57 + way->fall + way->ahead;
}

static int is_way(const struct timebase *tb, const struct way *way)
{
    const struct override_ramp *m = &tb->plan.move;
    if (!(IS_RATE(tb->now.override_q57) && tb->now.slope_q56 == way->slope)) {
        return 0;
    }
    if (!override_ramp_moves(m)) {
        return way->slope == 0 && way->fall == 0 && way->ahead == 0;
    }
    return m->end_q57 == tb->now.override_q57 + way->fall && IS_RATE(end_of(tb, way)) &&
           m->rise <= MOST_HALF && m->fall <= MOST_HALF && m->rise + m->fall <= MOST_HALF &&
           along(way->slope, m->step_q56) && along(way->fall, m->step_q56) &&
           along(way->ahead, m->step_q56);
}

/* --- The plan --- */

static int task_is_sound(const struct timebase *tb)
{
    const struct override_plan *plan = &tb->plan;
    int above = rate_plan_from(tb) > tb->least_q57;
    int64_t aim = plan->task == OVERRIDE_BEGINS ? plan->goal_q57 : plan->target_q57;
    if (plan->task == OVERRIDE_DECIDES) {
        return 1;
    }
    if ((override_ramp_moves(&plan->move) && plan->kind != OVERRIDE_SETTLE) || !IS_RATE(aim) ||
        plan->wanted_q57 < 0 || (plan->task == OVERRIDE_BEGINS && !IS_TICKS(&plan->ticks))) {
        return 0;
    }
    switch (plan->kind) {
    case OVERRIDE_STAY:
        return above && plan->task == OVERRIDE_SEARCHES;
    case OVERRIDE_RETURN:
        return above && aim <= tb->least_q57;
    case OVERRIDE_SETTLE:
        return !above && aim <= tb->least_q57;
    default:
        return plan->task == OVERRIDE_SEARCHES || IS_TICKS(&plan->back);
    }
}

/* Above the least factor the way back is known. */
static int is_sound(const struct timebase *tb, const struct way *way)
{
    const struct override_plan *plan = &tb->plan;
    int above = tb->now.override_q57 > tb->least_q57 || end_of(tb, way) > tb->least_q57;
    return is_way(tb, way) && task_is_sound(tb) && plan->task <= OVERRIDE_BEGINS &&
           plan->kind <= OVERRIDE_CLIMB && plan->window <= OVERRIDE_WINDOWS && plan->wanted_q57 >= -1 &&
           plan->wanted_q57 <= OVERRIDE_MOST && (!above || IS_TICKS(&plan->back));
}

static void any_timebase(struct timebase *tb, struct way *way)
{
    assume(IS_FACTOR(tb->least.factor_q14));
    tb->least_q57 = (int64_t)tb->least.factor_q14 << 43;
    assume(IS_RATE(tb->override_q57));
    assume(tb->state <= TIMEBASE_HELD);
    assume(IS_RATE(tb->now.override_q57));
    way->slope = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    way->fall = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    way->ahead = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    assume(tb->plan.move.step_q56 >= -OVERRIDE_MOST && tb->plan.move.step_q56 <= OVERRIDE_MOST);
    assume(is_sound(tb, way));
}

#endif
