/* SPDX-License-Identifier: MIT */
/* Implements core/override_plan.h (see there): which override ramp comes next towards the commanded override, and a
 * tick of it. Used by core/feed_override. Tick, except override_plan_begin. Changes only its struct; no I/O. */
#include "core/override_plan.h"

#include <string.h>

#include "core/qmath.h"

#define SMALL   ((int64_t)1 << 28) /* a slope that all bounds allow */
#define NOWHERE UINT32_MAX
#define EARLY   16u /* ticks before the end of a ramp in which the next one is searched */
/* Half of a ramp above guaranteed_q57: it leaves less than OVERRIDE_SPARE. */
#define MOST_TICKS ((uint32_t)1 << 18)
/* Periods: three ticks from decision to ramp, at twice the override, and rounding; and those until the end of a ramp.
 * */
#define MARGIN 8u

static const struct ramp_ticks SHORTEST = {1, 1};

/* --- Commands --- */

static void begin_from_0(struct override_plan *plan)
{
    memset(&plan->ramp, 0, sizeof plan->ramp);
    plan->now.override_q57 = 0;
    plan->now.slope_q56 = 0;
    plan->steady = 0;
    plan->saturated = 0;
    plan->task = OVERRIDE_DECIDES;
    plan->searched = NOWHERE;
    plan->wanted_q57 = -1; /* none yet */
    plan->return_q32_s = 0;
}

void override_plan_begin(struct override_plan *plan, const struct program *p)
{
    memset(plan, 0, sizeof *plan);
    override_bounds_of(&plan->guaranteed, p, 0, p->header.piece_count);
    plan->guaranteed_q57 = override_of_factor(plan->guaranteed.factor_q14);
    plan->requested_q57 = OVERRIDE_ONE;
    plan->most_q57 = OVERRIDE_MOST;
    plan->commanded_q57 = OVERRIDE_ONE;
    begin_from_0(plan);
}

void override_plan_limit(struct override_plan *plan, int64_t most_q57)
{
    const int64_t counts_q57 = qmath_lesser(plan->requested_q57, most_q57);
    plan->most_q57 = most_q57;
    if (plan->commanded_q57 != counts_q57) {
        plan->commanded_q57 = counts_q57;
        plan->steady = 0;
    }
}

int override_plan_ends_by(const struct override_plan *plan, uint64_t time_q32_s)
{
    if (plan->steady != 0u) {
        return 1;
    }
    return override_ramp_moves(&plan->ramp) && plan->task == OVERRIDE_DECIDES &&
           plan->now.override_q57 <= plan->guaranteed_q57 && plan->ends_q32_s <= time_q32_s;
}

void override_plan_carry(struct override_plan *plan, const struct program_override *least,
                         uint64_t shift_q32_s)
{
    plan->guaranteed = *least;
    plan->guaranteed_q57 = override_of_factor(least->factor_q14);
    plan->ahead.bounds =
        &plan->guaranteed; /* of a window of the previous program: not evaluated again */
    plan->ends_q32_s -= plan->ends_q32_s < shift_q32_s ? plan->ends_q32_s : shift_q32_s;
    plan->searched = NOWHERE;
}

void override_plan_forget_records(struct override_plan *plan)
{
    if (plan->ahead.bounds != NULL) {
        plan->kept = *plan->ahead.bounds;
        plan->ahead.bounds = &plan->kept;
    }
}

void override_plan_begin_next(struct override_plan *plan, const struct program_override *least)
{
    override_plan_carry(plan, least, 0);
    begin_from_0(plan);
    plan->started = 0;
}

void override_plan_restart(struct override_plan *plan)
{
    plan->started = 1;
    begin_from_0(plan);
}

void override_plan_set(struct override_plan *plan, uint32_t percent)
{
    const uint32_t used = percent < OVERRIDE_MOST_PERCENT ? percent : OVERRIDE_MOST_PERCENT;
    plan->requested_q57 = (int64_t)qmath_div_u64(((uint64_t)OVERRIDE_ONE >> 2) * used, 25u);
    override_plan_limit(plan, plan->most_q57);
}

void override_plan_hold(struct override_plan *plan)
{
    plan->held = 1;
    plan->steady = 0;
}

void override_plan_release(struct override_plan *plan)
{
    plan->held = 0;
    plan->steady = 0;
}

void override_plan_end_rise(struct override_plan *plan)
{
    if (plan->ramp.step_q56 > 0) {
        override_ramp_cut(&plan->ramp);
    }
}

static int64_t wanted_override(const struct override_plan *plan)
{
    return plan->held != 0 ? 0 : plan->commanded_q57;
}

/* --- Look-ahead --- */

void override_window_get(struct override_window *w, const struct program_clock *clock,
                         uint32_t window)
{
    w->bounds = &clock->record->ahead[window];
    w->end_q32_s = clock->record->ahead_end_q32_s[window];
}

static int64_t factor_q57(const struct override_window *w)
{
    return override_of_factor(w->bounds->factor_q14);
}

/* The next constant override: the end of a ramp under way. */
static int64_t next_constant(const struct override_plan *plan)
{
    return override_ramp_moves(&plan->ramp) ? plan->ramp.end_q57 : plan->now.override_q57;
}

static uint64_t margin_q32(const struct override_plan *plan, const struct program_clock *clock)
{
    return qmath_product_unsigned(MARGIN + 2u * plan->ramp.fall, clock->period_q32_s);
}

/* --- A search: windows, the narrowest first, each in four ticks --- */

static void begin_search(struct override_plan *plan, enum override_kind kind, int64_t target_q57)
{
    plan->task = OVERRIDE_SEARCHES;
    plan->kind = kind;
    plan->ends_q32_s = UINT64_MAX; /* until a ramp is found that ends at a permitted override */
    plan->target_q57 = target_q57;
    plan->step = OVERRIDE_EVALUATES;
    plan->window = 0;
}

/* Begins the return ramp, which was found before the override rose. */
static void begin_return(struct override_plan *plan)
{
    plan->ticks = plan->back;
    plan->kind = OVERRIDE_RETURN;
    plan->ends_q32_s = UINT64_MAX;
    plan->stage.end_q57 = plan->guaranteed_q57 - OVERRIDE_SPARE;
    plan->task = OVERRIDE_BEGINS;
}

/* No window allows what was searched, which was not OVERRIDE_SETTLE. */
static void search_failed(struct override_plan *plan)
{
    const int64_t now_q57 = plan->now.override_q57;
    plan->task = OVERRIDE_DECIDES;
    if (plan->kind == OVERRIDE_STAY) {
        begin_search(plan, OVERRIDE_CLIMB, plan->wanted_q57);
    } else if (now_q57 > plan->guaranteed_q57) {
        if (plan->kind == OVERRIDE_RETURN || now_q57 > plan->wanted_q57 + OVERRIDE_SPARE) {
            begin_return(plan);
        }
    } else if (now_q57 != plan->guaranteed_q57) {
        begin_search(plan, OVERRIDE_SETTLE, plan->guaranteed_q57);
    }
}

/* Whether a ramp up to an override above guaranteed_q57 is useful, and allowed in the window. Sets `target_q57` to that
 * override. */
static int may_climb(struct override_plan *plan)
{
    const int64_t now_q57 = plan->now.override_q57;
    const int64_t factor = factor_q57(&plan->ahead);
    plan->target_q57 = qmath_lesser(plan->wanted_q57, factor);
    return now_q57 <= factor && plan->target_q57 > plan->guaranteed_q57 + OVERRIDE_SPARE &&
           qmath_magnitude(plan->target_q57 - now_q57) > OVERRIDE_SPARE;
}

/* Limits the target to the factor of the window, for an override above guaranteed_q57. */
static void check_factor(struct override_plan *plan)
{
    if (plan->kind == OVERRIDE_CLIMB) {
        if (!may_climb(plan)) {
            search_failed(plan);
        }
    } else if (factor_q57(&plan->ahead) < plan->now.override_q57) {
        if (plan->kind == OVERRIDE_STAY) {
            search_failed(plan);
        } else {
            plan->step = OVERRIDE_EVALUATES;
        }
    }
}

/* Evaluates the next window. After the last one, below guaranteed_q57, the least bounds of the program, which are
 * always enough. */
static void evaluate_window(struct override_plan *plan, const struct program_clock *clock)
{
    plan->step = OVERRIDE_STAGES;
    if (plan->window < OVERRIDE_WINDOWS) {
        override_window_get(&plan->ahead, clock, plan->window);
        plan->window++;
        if (plan->kind != OVERRIDE_SETTLE) {
            check_factor(plan);
        }
    } else if (plan->kind == OVERRIDE_SETTLE) {
        plan->ahead.bounds = &plan->guaranteed;
        plan->ahead.end_q32_s = UINT64_MAX;
    } else {
        search_failed(plan);
    }
    if (plan->step == OVERRIDE_STAGES && plan->kind != OVERRIDE_STAY) {
        override_change_of(&plan->change, next_constant(plan), plan->target_q57);
    }
}

/* How far one ramp may go with the bounds of the window. Above guaranteed_q57 one ramp makes the whole change, or none.
 * */
static void find_stage(struct override_plan *plan)
{
    plan->step = OVERRIDE_MEASURES;
    if (plan->kind == OVERRIDE_STAY) {
        plan->stage.end_q57 = plan->now.override_q57;
        plan->stage.level = PROGRAM_LEVEL_FULL;
        return;
    }
    override_stage_of(&plan->stage, plan->ahead.bounds, &plan->change);
    if (plan->kind == OVERRIDE_CLIMB) {
        plan->stage.level = PROGRAM_LEVEL_FULL;
        if (plan->stage.end_q57 != plan->target_q57) {
            search_failed(plan);
        }
    }
}

/* Greatest change of the override that the same ticks have to be enough for: the ramp, and above guaranteed_q57 the
 * ramp back. */
static int64_t change_q57(const struct override_plan *plan, int64_t from_q57)
{
    const int64_t back_q57 = plan->high_q57 - plan->guaranteed_q57 + OVERRIDE_SPARE;
    const int64_t ramp_q57 = qmath_magnitude(plan->stage.end_q57 - from_q57);
    if (plan->kind == OVERRIDE_STAY) {
        return back_q57;
    }
    return plan->kind == OVERRIDE_CLIMB ? qmath_greater(ramp_q57, back_q57) : ramp_q57;
}

/* How long the ramp takes. */
static void measure(struct override_plan *plan, const struct program_clock *clock)
{
    const int64_t from_q57 = next_constant(plan);
    struct ramp_limits limits;
    plan->step = OVERRIDE_FITS;
    plan->high_q57 = from_q57;
    if (plan->kind == OVERRIDE_CLIMB) {
        plan->high_q57 = qmath_greater(plan->stage.end_q57, from_q57);
    }
    override_limits_of(&limits, plan->ahead.bounds, plan->stage.level, clock->period_log2);
    override_ticks_of(&plan->ticks, &limits, change_q57(plan, from_q57));
}

/* Whether a ramp to the end of the stage ends inside the window, also if it ends early. Sets ends_q32_s. */
static int fits(struct override_plan *plan, const struct program_clock *clock)
{
    const int64_t mean_q57 = (plan->stage.end_q57 + plan->high_q57) / 2;
    const uint64_t whole = override_span_q32(&plan->ticks, mean_q57, clock->period_q32_s);
    /* A fall that ends early may last 1.09 times as long in program time. */
    const uint64_t span = whole + (plan->stage.end_q57 < plan->high_q57 ? whole >> 3 : 0u);
    plan->ends_q32_s = qmath_q32_of_q42(clock->time_q42_s) + span + margin_q32(plan, clock);
    return plan->ends_q32_s <= plan->ahead.end_q32_s &&
           (plan->kind == OVERRIDE_SETTLE || plan->ticks.half < MOST_TICKS);
}

/* Until when an override above guaranteed_q57 may last, so that the return ramp, at most at this override, ends inside
 * the window. 0: not at all. */
static uint64_t return_by(const struct override_plan *plan, const struct program_clock *clock)
{
    const uint64_t span = margin_q32(plan, clock) +
                          override_span_q32(&plan->ticks, plan->high_q57, clock->period_q32_s);
    const uint64_t end_q32_s = plan->ahead.end_q32_s;
    return plan->ticks.half < MOST_TICKS && span < end_q32_s ? end_q32_s - span : 0;
}

/* The present override may stay for a longer time than before; or a ramp up begins, if the window has time for the
 * return ramp as well. */
static void fit_above(struct override_plan *plan, const struct program_clock *clock)
{
    const uint64_t by_q32_s = return_by(plan, clock);
    const int stays = plan->kind == OVERRIDE_STAY;
    /* latest end of the ramp up, if it takes as long as the return ramp */
    const uint64_t there_q32_s = plan->ahead.end_q32_s - by_q32_s;
    if (stays ? by_q32_s <= plan->return_q32_s
              : by_q32_s == 0 || qmath_q32_of_q42(clock->time_q42_s) + there_q32_s > by_q32_s) {
        return;
    }
    plan->return_q32_s = by_q32_s;
    plan->back = plan->ticks;
    if (!stays) {
        plan->saturated = plan->stage.end_q57 < plan->wanted_q57;
        plan->task = OVERRIDE_BEGINS;
    }
}

void override_plan_search(struct override_plan *plan, const struct program_clock *clock)
{
    if (plan->step == OVERRIDE_EVALUATES) {
        evaluate_window(plan, clock);
    } else if (plan->step == OVERRIDE_STAGES) {
        find_stage(plan);
    } else if (plan->step == OVERRIDE_MEASURES) {
        measure(plan, clock);
    } else {
        plan->step = OVERRIDE_EVALUATES;
        if (plan->kind == OVERRIDE_STAY || plan->kind == OVERRIDE_CLIMB) {
            fit_above(plan, clock);
        } else if (fits(plan, clock)) {
            plan->task = OVERRIDE_BEGINS;
        }
    }
}

/* --- At a constant override --- */

static void begin_ramp(struct override_plan *plan, int64_t step_q56)
{
    const int down = plan->stage.end_q57 < plan->now.override_q57;
    override_ramp_begin(&plan->ramp, plan->now.override_q57, &plan->ticks,
                        down ? -step_q56 : step_q56);
    if (plan->kind == OVERRIDE_SETTLE && plan->window > 1) { /* not inside the present piece */
        override_ramp_shorten(&plan->ramp);
    }
    plan->task = OVERRIDE_DECIDES;
    plan->searched = NOWHERE;
}

static void decide_below(struct override_plan *plan, int64_t wanted_q57)
{
    const int64_t change_q57 = wanted_q57 - plan->now.override_q57;
    plan->saturated = 0;
    if (qmath_magnitude(change_q57) <= 1) {
        plan->now.override_q57 = wanted_q57;
    } else if (plan->now.override_q57 > plan->guaranteed_q57) {
        begin_search(plan, OVERRIDE_RETURN,
                     qmath_lesser(wanted_q57, plan->guaranteed_q57 - OVERRIDE_SPARE));
    } else if (qmath_magnitude(change_q57) <= SMALL) {
        plan->ticks = SHORTEST;
        plan->kind = OVERRIDE_SETTLE;
        plan->ends_q32_s = 0; /* all pieces allow it */
        plan->stage.end_q57 = wanted_q57;
        begin_ramp(plan, qmath_magnitude(change_q57) / 2);
    } else {
        begin_search(plan, OVERRIDE_SETTLE, wanted_q57);
    }
}

/* What to do next. Above guaranteed_q57 once in each piece. */
static void decide(struct override_plan *plan, const struct program_clock *clock)
{
    const int64_t wanted_q57 = wanted_override(plan);
    const int same = plan->wanted_q57 == wanted_q57;
    plan->wanted_q57 = wanted_q57;
    if (wanted_q57 <= plan->guaranteed_q57) {
        decide_below(plan, wanted_q57);
    } else if (!same || plan->searched != clock->piece) {
        const int above = plan->now.override_q57 > plan->guaranteed_q57;
        plan->searched = clock->piece;
        plan->saturated = wanted_q57 - plan->now.override_q57 > OVERRIDE_SPARE;
        begin_search(plan, above ? OVERRIDE_STAY : OVERRIDE_CLIMB, wanted_q57);
    }
}

/* At a constant override that is not the commanded one: one step of the decision. */
static void tick_of_decision(struct override_plan *plan, const struct program_clock *clock)
{
    if (plan->now.override_q57 > plan->guaranteed_q57 &&
        qmath_q32_of_q42(clock->time_q42_s) >= plan->return_q32_s) {
        begin_return(plan);
    }
    if (plan->task == OVERRIDE_BEGINS) {
        const int64_t change_q57 = qmath_magnitude(plan->stage.end_q57 - plan->now.override_q57);
        begin_ramp(plan, override_step_of(&plan->ticks, change_q57));
    } else if (plan->task == OVERRIDE_SEARCHES) {
        override_plan_search(plan, clock);
    } else {
        decide(plan, clock);
    }
}

/* 1 if the override is the commanded one and all pieces allow it. Then the next tick is like this one, and a plan is
 * dropped. */
static int comes_steady(struct override_plan *plan)
{
    const int64_t wanted_q57 = wanted_override(plan);
    if (wanted_q57 > plan->guaranteed_q57 || plan->now.override_q57 != wanted_q57) {
        return 0;
    }
    plan->task = OVERRIDE_DECIDES; /* the command may have come back to it */
    plan->searched = NOWHERE;
    plan->saturated = 0;
    plan->steady = 1;
    return 1;
}

/* --- On a ramp --- */

/* Another override is commanded: the ramp continues until an early ramp end would lead there, or beyond. Above
 * guaranteed_q57 a falling ramp does not end early, because no return ramp would be known. */
static void change_target(struct override_plan *plan, int64_t wanted_q57)
{
    struct override_ramp *ramp = &plan->ramp;
    if (plan->kind == OVERRIDE_RETURN && ramp->end_q57 > plan->guaranteed_q57) {
        return;
    }
    if (ramp->step_q56 > 0 ? ramp->end_q57 >= wanted_q57 : ramp->end_q57 <= wanted_q57) {
        override_ramp_cut(ramp);
    }
}

/* A stage ends soon: searches the next one, so that the time of constant override between them is short. */
static void search_early(struct override_plan *plan, const struct program_clock *clock,
                         int64_t wanted_q57)
{
    const struct override_ramp *ramp = &plan->ramp;
    if ((ramp->rise | ramp->even) != 0u || ramp->fall > EARLY || plan->kind != OVERRIDE_SETTLE ||
        wanted_q57 > plan->guaranteed_q57) {
        return;
    }
    if (plan->task == OVERRIDE_SEARCHES) {
        override_plan_search(plan, clock);
    } else if (plan->task == OVERRIDE_DECIDES &&
               qmath_magnitude(wanted_q57 - ramp->end_q57) > SMALL) {
        begin_search(plan, OVERRIDE_SETTLE, wanted_q57);
    }
}

/* Slope at the end of the next tick of the ramp. */
static int64_t next_slope(struct override_plan *plan, const struct program_clock *clock)
{
    const int64_t wanted_q57 = wanted_override(plan);
    if (wanted_q57 != plan->wanted_q57) {
        change_target(plan, wanted_q57);
    } else {
        search_early(plan, clock, wanted_q57);
    }
    return override_ramp_slope(&plan->ramp, plan->now.slope_q56);
}

/* --- Tick --- */

/* A program begins with feed and acceleration 0: there the override may change in a step. */
static void first_tick(struct override_plan *plan, struct program_clock *clock)
{
    plan->started = 1;
    if (clock->time_q42_s != 0) {
        return;
    }
    plan->now.override_q57 = qmath_lesser(wanted_override(plan), OVERRIDE_ONE);
    if (plan->now.override_q57 != OVERRIDE_ONE) { /* at 1 a tick is a period exactly */
        clock->even_q62_s = program_clock_step_q62_s(clock, &plan->now, 0);
    }
    (void)comes_steady(plan);
}

static void tick_of_ramp(struct override_plan *plan, struct program_clock *clock)
{
    const int64_t slope_q56 = next_slope(plan, clock);
    program_clock_advance_q62(clock, program_clock_step_q62_s(clock, &plan->now, slope_q56));
    override_tick(&plan->now, slope_q56);
    clock->even_q62_s = 0;
}

void override_plan_change(struct override_plan *plan, struct program_clock *clock)
{
    if (plan->started == 0) {
        first_tick(plan, clock);
        return;
    }
    if (override_ramp_moves(&plan->ramp)) {
        tick_of_ramp(plan, clock);
        return;
    }
    if (clock->even_q62_s == 0) { /* after a ramp; its last tick has no time for it */
        clock->even_q62_s = program_clock_step_q62_s(clock, &plan->now, 0);
    }
    if (!comes_steady(plan)) {
        tick_of_decision(plan, clock);
    }
    if (plan->now.override_q57 != 0) {
        program_clock_advance_even(clock, plan->now.override_q57);
    }
}

uint64_t override_plan_tick(struct override_plan *plan, struct program_clock *clock)
{
    if (plan->steady != 0) { /* no ramp and no search: as in the last tick */
        program_clock_advance_even(clock, plan->now.override_q57);
    } else {
        override_plan_change(plan, clock);
    }
    return program_clock_enter(clock);
}
