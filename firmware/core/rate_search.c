/* SPDX-License-Identifier: MIT */
#include "core/rate_search.h"

#include "core/qmath.h"
#include "core/rate_window.h"
#include "core/timebase.h"

#define MOST_TICKS                                                                                 \
    ((uint32_t)1 << 18) /* half of a way above the least factor: it leaves less than RATE_SPARE */
#define MARGIN                                                                                     \
    8u /* periods: three ticks from decision to move, at twice the rate, and rounding; and those until the rest */

static uint64_t margin_q32(const struct timebase *tb)
{
    return qmath_product_unsigned(MARGIN + 2u * tb->plan.move.fall, tb->period_q32_s);
}

void rate_search_stage(struct timebase *tb, const struct program_override *bounds)
{
    struct rate_plan *plan = &tb->plan;
    const int64_t rate = rate_plan_from(tb);
    struct rate_stage stage;
    struct rate_pace pace;
    rate_stage_of(&stage, bounds, rate, plan->target_q57);
    rate_pace_of(&pace, bounds, stage.level, tb->period_log2);
    rate_ticks_of(&plan->ticks, &pace, qmath_magnitude(stage.goal_q57 - rate));
    plan->goal_q57 = stage.goal_q57;
}

/* A way that ends where the rate may stay: inside the window. */
static int fits(struct timebase *tb, const struct rate_window *w)
{
    const struct rate_plan *plan = &tb->plan;
    const int64_t rate = rate_plan_from(tb);
    rate_search_stage(tb, w->bounds);
    uint64_t span = rate_span_q32(&plan->ticks, (plan->goal_q57 + rate) / 2, tb->period_q32_s);
    return (tb->time_q42_s >> 10) + span + margin_q32(tb) <= w->end_q32_s;
}

static int64_t factor_q57(const struct rate_window *w)
{
    return (int64_t)w->bounds->factor_q14 << 43;
}

static int leaves(struct timebase *tb, const struct rate_window *w)
{
    return factor_q57(w) >= tb->now.rate_q57 && fits(tb, w) && tb->plan.ticks.half < MOST_TICKS;
}

/* Until when a rate above the least factor may last: the way back, at most at this rate, ends inside the window. 0: not
 * at all. */
static uint64_t back_by(const struct timebase *tb, const struct rate_window *w, int64_t way_q57,
                        int64_t high_q57, struct rate_ticks *ticks)
{
    struct rate_pace pace;
    rate_pace_of(&pace, w->bounds, PROGRAM_LEVEL_FULL, tb->period_log2);
    rate_ticks_of(ticks, &pace, way_q57);
    uint64_t span = rate_span_q32(ticks, high_q57, tb->period_q32_s) + margin_q32(tb);
    return ticks->half < MOST_TICKS && span < w->end_q32_s ? w->end_q32_s - span : 0;
}

/* The present rate, for longer than is known. */
static void stay(struct timebase *tb, const struct rate_window *w)
{
    struct rate_ticks ticks;
    int64_t rate = tb->now.rate_q57;
    if (factor_q57(w) < rate) {
        rate_plan_give_up(tb);
        return;
    }
    uint64_t leave = back_by(tb, w, rate - tb->least_q57 + RATE_SPARE, rate, &ticks);
    if (leave > tb->plan.leave_q32_s) {
        tb->plan.leave_q32_s = leave;
        tb->plan.back = ticks;
    }
}

/* A way to a rate above the least factor, for which it has the time of the way back too. The same ticks are enough for
 * both. */
static void climb(struct timebase *tb, const struct rate_window *w)
{
    struct rate_plan *plan = &tb->plan;
    int64_t rate = tb->now.rate_q57;
    int64_t factor = factor_q57(w);
    struct rate_stage stage;
    int64_t goal = qmath_lesser(plan->wanted_q57, factor);
    int64_t high = qmath_greater(goal, rate);
    int64_t way = qmath_magnitude(goal - rate);
    rate_stage_of(&stage, w->bounds, rate, goal);
    if (high > factor || goal <= tb->least_q57 + RATE_SPARE || way <= RATE_SPARE ||
        stage.goal_q57 != goal) {
        rate_plan_give_up(tb);
        return;
    }
    uint64_t leave =
        back_by(tb, w, qmath_greater(way, high - tb->least_q57 + RATE_SPARE), high, &plan->ticks);
    uint64_t there = w->end_q32_s - leave; /* by then, if it takes what the way back may take */
    if (leave == 0 || (tb->time_q42_s >> 10) + there > leave) {
        return;
    }
    plan->goal_q57 = goal;
    plan->leave_q32_s = leave;
    plan->back = plan->ticks;
    tb->saturated = goal < plan->wanted_q57;
    plan->task = RATE_TASK_BEGIN;
}

void rate_search(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    struct rate_window w;
    rate_window_get(&w, tb, plan->window);
    plan->window++;
    switch (plan->kind) {
    case RATE_STAY:
        stay(tb, &w);
        break;
    case RATE_CLIMB:
        climb(tb, &w);
        break;
    case RATE_LEAVE:
        plan->task = leaves(tb, &w) ? RATE_TASK_BEGIN : RATE_TASK_SEARCH;
        break;
    default:
        plan->task = fits(tb, &w) ? RATE_TASK_BEGIN : RATE_TASK_SEARCH;
        break;
    }
}
