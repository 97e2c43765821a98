/* SPDX-License-Identifier: MIT */
/*
 * What holds of the plan of the override before and after every tick, `is_sound`: the override is in [0, 2], so is
 * where a ramp ends, no slope is greater than a change, and a ramp that is searched or about to begin is possible.
 * cbmc_plan.c shows it for ticks at rest, with every command, and from the first tick on; docs/theory/proofs.md
 * section 15.4 argues it for ticks of a ramp.
 *
 * With d the step, f the ticks risen, r and e those of rise and of even slope that are left, the slope is d f, a cut
 * would raise the override by d f^2, and what is still to come before the fall raises it by 4 d f r + 2 d r^2 + 2 d e
 * (f + r) more: three numbers of their own here. Included by cbmc_plan.c; never executed, touches nothing.
 */
#ifndef HODOGRAPH_PLAN_IS_SOUND_H
#define HODOGRAPH_PLAN_IS_SOUND_H

#include "proof.h"
#include "ramp_contracts.h"

#include "core/override_ramp.c"
#include "core/override_plan.c"

/* --- What the plan stands on: override_contracts.h --- */

static int64_t begun_q57; /* the change that a step was made for */
static struct program_override ahead; /* bounds of the window that is evaluated */

void some_ticks(struct ramp_ticks *ticks, const struct ramp_limits *limits, int64_t change_q57)
{
    (void)limits;
    prove(IS_OVERRIDE(change_q57));
    ticks->rise = nondet_uint32();
    ticks->half = nondet_uint32();
    assume(IS_TICKS(ticks));
}

int64_t some_step(const struct ramp_ticks *ticks, int64_t change_q57)
{
    prove(IS_TICKS(ticks));
    prove(IS_OVERRIDE(change_q57));
    begun_q57 = change_q57;
    return any_between(0, change_q57 / 2);
}

uint64_t some_span(const struct ramp_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s)
{
    (void)period_q32_s;
    prove(IS_TICKS(ticks));
    prove(IS_OVERRIDE(mean_q57));
    uint64_t span = nondet_uint64();
    assume(span <= MOST_SPAN);
    return span;
}

void some_change(struct ramp_change *out, int64_t from_q57, int64_t to_q57)
{
    prove(IS_OVERRIDE(from_q57) && IS_OVERRIDE(to_q57));
    out->from_q57 = from_q57;
    out->to_q57 = to_q57;
    out->first = nondet_uint32();
    out->last = nondet_uint32();
    assume(IS_CHANGE(out));
}

/* Between both ends; the end of a stage is that of a level below 1. */
void some_stage(struct ramp_stage *out, const struct program_override *bounds,
                const struct ramp_change *change)
{
    const int64_t from_q57 = change->from_q57;
    const int64_t to_q57 = change->to_q57;
    (void)bounds;
    prove(IS_CHANGE(change));
    out->level = nondet_uint32();
    out->end_q57 = nondet_int64();
    assume(out->end_q57 == to_q57 || out->end_q57 < OVERRIDE_ONE);
    assume(IS_STAGE(out) && (from_q57 < to_q57 ? from_q57 <= out->end_q57 && out->end_q57 <= to_q57
                                               : to_q57 <= out->end_q57 && out->end_q57 <= from_q57));
}

void some_limits(struct ramp_limits *out, const struct program_override *bounds, uint32_t level,
               uint32_t period_log2)
{
    (void)bounds;
    (void)period_log2;
    prove(level < PROGRAM_LEVELS);
    assume(IS_LIMITS(out));
}

void some_window(struct override_window *w, const struct program_clock *clock, uint32_t window)
{
    (void)clock;
    prove(window < OVERRIDE_WINDOWS);
    ahead.factor_q14 = (uint16_t)nondet_uint32();
    assume(IS_FACTOR(ahead.factor_q14));
    w->bounds = &ahead;
    w->end_q32_s = nondet_uint64();
}

/* --- A ramp --- */

struct way {
    int64_t slope; /* d f */
    int64_t fall;  /* d f^2 */
    int64_t ahead; /* what rise and even slope still add to where a cut would end */
};

static int along(int64_t a, int64_t step)
{
    return step < 0 ? a <= 0 : a >= 0;
}

static int64_t end_of(const struct override_plan *plan, const struct way *way)
{
    return plan->now.override_q57 + way->fall + way->ahead;
}

static int is_way(const struct override_plan *plan, const struct way *way)
{
    const struct override_ramp *r = &plan->ramp;
    if (!(IS_OVERRIDE(plan->now.override_q57) && plan->now.slope_q56 == way->slope)) {
        return 0;
    }
    if (!override_ramp_moves(r)) {
        return way->slope == 0 && way->fall == 0 && way->ahead == 0;
    }
    return r->end_q57 == plan->now.override_q57 + way->fall && IS_OVERRIDE(end_of(plan, way)) &&
           r->rise <= MOST_HALF && r->fall <= MOST_HALF && r->rise + r->fall <= MOST_HALF &&
           along(way->slope, r->step_q56) && along(way->fall, r->step_q56) &&
           along(way->ahead, r->step_q56);
}

/* --- The plan --- */

static int is_above(const struct override_plan *plan)
{
    return next_constant(plan) > plan->guaranteed_q57;
}

/* What the steps of a search leave to the next ones. */
static int search_is_sound(const struct override_plan *plan)
{
    const int climbs = plan->kind == OVERRIDE_CLIMB;
    if (plan->step >= OVERRIDE_STAGES &&
        ((climbs && plan->target_q57 <= plan->guaranteed_q57 + OVERRIDE_SPARE) ||
         !IS_OVERRIDE(plan->target_q57))) {
        return 0;
    }
    if (plan->step == OVERRIDE_STAGES && plan->kind != OVERRIDE_STAY &&
        !(IS_CHANGE(&plan->change) && plan->change.from_q57 == next_constant(plan) &&
          plan->change.to_q57 == plan->target_q57)) {
        return 0;
    }
    if (plan->step >= OVERRIDE_MEASURES &&
        (plan->stage.level >= PROGRAM_LEVELS ||
         !IS_OVERRIDE(plan->stage.end_q57) ||
         (climbs && plan->stage.end_q57 != plan->target_q57) ||
         ((plan->kind == OVERRIDE_RETURN || plan->kind == OVERRIDE_SETTLE) &&
          plan->stage.end_q57 > plan->guaranteed_q57))) {
        return 0;
    }
    return plan->step <= OVERRIDE_FITS &&
           (plan->step < OVERRIDE_FITS ||
            (IS_TICKS(&plan->ticks) && IS_OVERRIDE(plan->high_q57)));
}

static int task_is_sound(const struct override_plan *plan)
{
    const int begins = plan->task == OVERRIDE_BEGINS;
    const int64_t aim = begins ? plan->stage.end_q57 : plan->target_q57;
    if (plan->task == OVERRIDE_DECIDES) {
        return 1;
    }
    if ((override_ramp_moves(&plan->ramp) && plan->kind != OVERRIDE_SETTLE) || !IS_OVERRIDE(aim) ||
        plan->wanted_q57 < 0 || (begins ? !IS_TICKS(&plan->ticks) : !search_is_sound(plan))) {
        return 0;
    }
    switch (plan->kind) {
    case OVERRIDE_STAY:
        return is_above(plan) && !begins;
    case OVERRIDE_RETURN:
        return is_above(plan) && aim <= plan->guaranteed_q57;
    case OVERRIDE_SETTLE:
        return !is_above(plan) && aim <= plan->guaranteed_q57;
    default:
        return !begins || IS_TICKS(&plan->back);
    }
}

/* Above guaranteed_q57 the ramp back is known. */
static int is_sound(const struct override_plan *plan, const struct way *way)
{
    const int above = plan->now.override_q57 > plan->guaranteed_q57 ||
                      end_of(plan, way) > plan->guaranteed_q57;
    return is_way(plan, way) && task_is_sound(plan) && plan->task <= OVERRIDE_BEGINS &&
           plan->kind <= OVERRIDE_CLIMB && plan->window <= OVERRIDE_WINDOWS &&
           plan->wanted_q57 >= -1 && plan->wanted_q57 <= OVERRIDE_MOST &&
           (!above || IS_TICKS(&plan->back));
}

static void any_plan(struct override_plan *plan, struct way *way)
{
    assume(IS_FACTOR(plan->guaranteed.factor_q14));
    plan->guaranteed_q57 = (int64_t)plan->guaranteed.factor_q14 << 43;
    ahead.factor_q14 = (uint16_t)nondet_uint32();
    assume(IS_FACTOR(ahead.factor_q14));
    plan->ahead.bounds = nondet_uint32() != 0 ? &ahead : &plan->guaranteed;
    assume(IS_OVERRIDE(plan->commanded_q57));
    assume(IS_OVERRIDE(plan->now.override_q57));
    way->slope = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    way->fall = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    way->ahead = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
    assume(plan->ramp.step_q56 >= -OVERRIDE_MOST && plan->ramp.step_q56 <= OVERRIDE_MOST);
    assume(is_sound(plan, way));
}

#endif
