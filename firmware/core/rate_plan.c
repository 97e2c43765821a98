/* SPDX-License-Identifier: MIT */
#include "core/rate_plan.h"

#include <string.h>

#include "core/qmath.h"
#include "core/rate_search.h"
#include "core/timebase.h"

#define SMALL   ((int64_t)1 << 28) /* a slope that all bounds allow */
#define NOWHERE UINT32_MAX
#define EARLY   8u /* ticks before a rest in which the next move is looked for */

static const struct rate_ticks SHORTEST = {1, 1};

void rate_plan_reset(struct rate_plan *plan)
{
    memset(plan, 0, sizeof *plan);
    plan->task = RATE_TASK_NONE;
    plan->searched = NOWHERE;
    plan->wanted_q57 = -1; /* none yet */
}

static int64_t wanted_rate(const struct timebase *tb)
{
    return tb->state == TIMEBASE_RUNNING ? tb->override_q57 : 0;
}

int rate_plan_steady(struct timebase *tb)
{
    int64_t wanted = wanted_rate(tb);
    if (wanted > tb->least_q57 || tb->now.rate_q57 != wanted) {
        return 0;
    }
    tb->plan.task = RATE_TASK_NONE; /* the wish may have come back to it */
    tb->plan.searched = NOWHERE;
    tb->saturated = 0;
    return 1;
}

/* --- On its way --- */

/* Another wish: the move goes on until a cut would end there, or beyond it. Not above the least factor on the way down,
 * where nothing says how to leave. */
static void change_mind(struct timebase *tb, int64_t wanted)
{
    struct rate_move *move = &tb->plan.move;
    if (tb->plan.kind == RATE_LEAVE && move->rest_q57 > tb->least_q57) {
        return;
    }
    if (move->step_q56 > 0 ? move->rest_q57 >= wanted : move->rest_q57 <= wanted) {
        rate_move_cut(move);
    }
}

/* --- At rest --- */

static void begin_move(struct timebase *tb, int64_t step_q56)
{
    struct rate_plan *plan = &tb->plan;
    int down = plan->goal_q57 < tb->now.rate_q57;
    rate_move_begin(&plan->move, &tb->now, &plan->ticks, down ? -step_q56 : step_q56);
    if (plan->kind == RATE_SETTLE && plan->window > 1) { /* not inside the present piece */
        rate_move_shorten(&plan->move);
    }
    plan->task = RATE_TASK_NONE;
    plan->searched = NOWHERE;
}

static void search(struct rate_plan *plan, enum rate_kind kind, int64_t target_q57)
{
    plan->task = RATE_TASK_SEARCH;
    plan->kind = kind;
    plan->target_q57 = target_q57;
    plan->window = 0;
}

/* The way back that was found before the rate went up. */
static void go_back(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    plan->ticks = plan->back;
    plan->kind = RATE_LEAVE;
    plan->goal_q57 = tb->least_q57 - RATE_SPARE;
    plan->task = RATE_TASK_BEGIN;
}

static void choose_below(struct timebase *tb, int64_t wanted)
{
    int64_t away = wanted - tb->now.rate_q57;
    tb->saturated = 0;
    if (qmath_magnitude(away) <= 1) {
        tb->now.rate_q57 = wanted;
    } else if (tb->now.rate_q57 > tb->least_q57) {
        search(&tb->plan, RATE_LEAVE, qmath_lesser(wanted, tb->least_q57 - RATE_SPARE));
    } else if (qmath_magnitude(away) <= SMALL) {
        tb->plan.ticks = SHORTEST;
        tb->plan.kind = RATE_SETTLE;
        tb->plan.goal_q57 = wanted;
        begin_move(tb, qmath_magnitude(away) / 2);
    } else {
        search(&tb->plan, RATE_SETTLE, wanted);
    }
}

/* What to do next. Above the least factor once in each piece. */
static void choose(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    int64_t wanted = wanted_rate(tb);
    int same = plan->wanted_q57 == wanted;
    plan->wanted_q57 = wanted;
    if (wanted <= tb->least_q57) {
        choose_below(tb, wanted);
    } else if (!same || plan->searched != tb->piece) {
        plan->searched = tb->piece;
        tb->saturated = wanted - tb->now.rate_q57 > RATE_SPARE;
        search(plan, tb->now.rate_q57 > tb->least_q57 ? RATE_STAY : RATE_CLIMB, wanted);
    }
}

void rate_plan_give_up(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    plan->task = RATE_TASK_NONE;
    if (plan->kind == RATE_STAY) {
        search(plan, RATE_CLIMB, plan->wanted_q57);
    } else if (tb->now.rate_q57 > tb->least_q57) {
        if (plan->kind == RATE_LEAVE || tb->now.rate_q57 > plan->wanted_q57 + RATE_SPARE) {
            go_back(tb);
        }
    } else if (tb->now.rate_q57 != tb->least_q57) {
        search(plan, RATE_SETTLE, tb->least_q57);
    }
}

/* There is no further window. Below the least factor of the program its least bounds will always do. */
static void look_no_more(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    if (plan->kind == RATE_SETTLE) {
        rate_search_stage(tb, &tb->least);
        plan->task = RATE_TASK_BEGIN;
    } else {
        rate_plan_give_up(tb);
    }
}

static void look(struct timebase *tb)
{
    if (tb->plan.window < RATE_WINDOWS) {
        rate_search(tb);
    } else {
        look_no_more(tb);
    }
}

void rate_plan_decide(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    if (tb->now.rate_q57 > tb->least_q57 && tb->time_q42_s >> 10 >= plan->leave_q32_s) {
        go_back(tb);
    }
    if (plan->task == RATE_TASK_BEGIN) {
        const int64_t way = qmath_magnitude(plan->goal_q57 - tb->now.rate_q57);
        begin_move(tb, rate_step_of(&plan->ticks, way));
    } else if (plan->task == RATE_TASK_SEARCH) {
        look(tb);
    } else {
        choose(tb);
    }
}

int64_t rate_plan_from(const struct timebase *tb)
{
    return rate_moves(&tb->plan.move) ? tb->plan.move.rest_q57 : tb->now.rate_q57;
}

/* A stage ends soon: the next one is looked for, so that the rest between them is short. */
static void look_early(struct timebase *tb, int64_t wanted)
{
    struct rate_plan *plan = &tb->plan;
    const struct rate_move *move = &plan->move;
    if ((move->rise | move->even) != 0u || move->fall > EARLY || plan->kind != RATE_SETTLE ||
        wanted > tb->least_q57) {
        return;
    }
    if (plan->task == RATE_TASK_SEARCH) {
        look(tb);
    } else if (plan->task == RATE_TASK_NONE && qmath_magnitude(wanted - move->rest_q57) > SMALL) {
        search(plan, RATE_SETTLE, wanted);
    }
}

int64_t rate_plan_move(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    int64_t wanted = wanted_rate(tb);
    if (wanted != plan->wanted_q57) {
        change_mind(tb, wanted);
    } else {
        look_early(tb, wanted);
    }
    return rate_move_slope(&plan->move, tb->now.slope_q56);
}
