/* SPDX-License-Identifier: MIT */
#include "core/rate_plan.h"

#define MOST_ROUNDS 6 /* a window that has still not been found is given up */

static int64_t greater(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static void open_window(const struct timebase *tb, struct rate_window *w)
{
    rate_window_open(w, tb->program, &tb->scale, tb->piece, tb->piece_end_q32_s, &tb->bounds);
}

static int same(const struct rate_bounds *a, const struct rate_bounds *b)
{
    return a->most_q57 == b->most_q57 && a->slope_q56 == b->slope_q56 &&
           a->second_q56 == b->second_q56;
}

/* Program time reached after so many ticks at rate 1, at most. */
static uint64_t reached_q32(const struct timebase *tb, int64_t ticks_q12)
{
    if (ticks_q12 == INT64_MAX) {
        return UINT64_MAX - 1u;
    }
    return (tb->time_q42_s >> 10) + (((uint64_t)ticks_q12 * tb->period_q32_s) >> 12) + 2u;
}

/* Whether the way to a target keeps all three bounds in pieces that have these. */
static int keeps(const struct rate *now, int64_t target_q57, const struct rate_bounds *bounds)
{
    int64_t rest = rate_rest(now, bounds->second_q56);
    int64_t high = greater(greater(now->rate_q57, rest), target_q57);
    return rest >= 0 && high <= bounds->most_q57 && now->slope_q56 <= bounds->slope_q56 &&
           now->slope_q56 >= -bounds->slope_q56;
}

/* Bounds with which the target can be reached from here inside all pieces on the way. */
static int find_bounds(const struct timebase *tb, int64_t target_q57, struct rate_bounds *out)
{
    struct rate_window w;
    open_window(tb, &w);
    for (int round = 0; round < MOST_ROUNDS && keeps(&tb->now, target_q57, &w.bounds); round++) {
        *out = w.bounds;
        uint64_t reached = reached_q32(tb, rate_span_q12(&tb->now, target_q57, out));
        while (reached > w.end_q32_s && rate_window_extend(&w) != 0) {
        }
        if (same(out, &w.bounds)) {
            if (reached <= w.end_q32_s) {
                return 1;
            }
            break;
        }
    }
    *out = tb->least;
    return keeps(&tb->now, target_q57, out);
}

static void plan(struct timebase *tb, int64_t target_q57)
{
    struct rate_bounds bounds;
    int renewed = tb->plan_target_q57 == target_q57;
    if (renewed && tb->plan_piece == tb->piece) {
        return;
    }
    tb->plan_piece = tb->piece;
    if (find_bounds(tb, target_q57, &bounds) == 0) {
        return;
    }
    if (!renewed ||
        (bounds.slope_q56 >= tb->plan.slope_q56 && bounds.second_q56 >= tb->plan.second_q56)) {
        tb->plan = bounds;
        tb->plan_target_q57 = target_q57;
    }
}

/* One tick towards the wanted rate, if from its end there is a way back to a rate that all pieces
 * of the program allow: the plan from then on. */
struct attempt {
    struct rate after;
    int64_t target_q57;
    int64_t back_q57;
};

static int try_tick(const struct timebase *tb, const struct rate_bounds *bounds, struct attempt *a)
{
    const struct rate *now = &tb->now;
    int64_t wanted = tb->override_q57;
    a->target_q57 = wanted < bounds->most_q57 ? wanted : bounds->most_q57;
    int64_t slope = rate_next_slope(now, a->target_q57, bounds);
    a->after = *now;
    rate_move(&a->after, slope);
    int64_t rest = rate_rest(&a->after, bounds->second_q56);
    a->back_q57 = rest < tb->least.most_q57 ? rest : tb->least.most_q57;
    int64_t inside = now->rate_q57 + greater(now->slope_q56, 0);
    return inside <= bounds->most_q57 && now->slope_q56 <= bounds->slope_q56 &&
           now->slope_q56 >= -bounds->slope_q56 && keeps(&a->after, a->back_q57, bounds);
}

/* Slopes move the rate by even steps near the target: the last unit may be left over. */
static int arrived(int64_t rate_q57, int64_t target_q57)
{
    return rate_q57 - target_q57 <= 1 && target_q57 - rate_q57 <= 1;
}

static int climb(struct timebase *tb, int64_t *slope_q56)
{
    struct rate_window w;
    struct attempt a;
    uint64_t margin = 4u * (uint64_t)tb->period_q32_s;
    if ((tb->time_q42_s >> 10) + margin <= tb->climb_end_q32_s) {
        *slope_q56 = 0;
        return 1;
    }
    open_window(tb, &w);
    for (int round = 0; round < MOST_ROUNDS && try_tick(tb, &w.bounds, &a); round++) {
        struct rate_bounds bounds = w.bounds;
        uint64_t reached = reached_q32(tb, rate_span_q12(&a.after, a.back_q57, &bounds)) + margin;
        while (reached > w.end_q32_s && w.bounds.most_q57 == bounds.most_q57 &&
               rate_window_extend(&w) != 0) {
        }
        if (reached <= w.end_q32_s && same(&bounds, &w.bounds)) {
            int still = a.after.slope_q56 == 0 && arrived(a.after.rate_q57, a.target_q57) &&
                        tb->now.slope_q56 == 0;
            uint64_t way = reached - (tb->time_q42_s >> 10);
            tb->climb_end_q32_s = still && w.end_q32_s > way ? w.end_q32_s - way : 0;
            tb->plan = bounds;
            tb->plan_target_q57 = a.back_q57;
            tb->plan_piece = tb->piece;
            tb->saturated = a.target_q57 < tb->override_q57;
            *slope_q56 = a.after.slope_q56;
            return 1;
        }
        if (same(&bounds, &w.bounds)) {
            break;
        }
    }
    tb->climb_piece = w.next - 1u > tb->piece ? w.next - 1u : tb->piece + 1u;
    tb->climb_end_q32_s = 0;
    return 0;
}

static int64_t wanted_rate(const struct timebase *tb)
{
    return tb->state == TIMEBASE_RUNNING ? tb->override_q57 : 0;
}

int rate_plan_steady(const struct timebase *tb)
{
    int64_t wanted = wanted_rate(tb);
    return wanted <= tb->least.most_q57 && tb->now.slope_q56 == 0 && tb->now.rate_q57 == wanted;
}

/* Of the present piece; most ticks need none. */
static void renew_bounds(struct timebase *tb)
{
    if (tb->bounds_piece != tb->piece) {
        rate_window_piece(&tb->scale, tb->program, tb->piece, &tb->bounds);
        tb->bounds_piece = tb->piece;
    }
}

int64_t rate_plan_slope(struct timebase *tb)
{
    int64_t wanted = wanted_rate(tb);
    int64_t slope = 0;
    tb->saturated = tb->saturated != 0 && wanted > tb->least.most_q57;
    if (wanted > tb->least.most_q57) {
        renew_bounds(tb);
        if (tb->piece >= tb->climb_piece && climb(tb, &slope) != 0) {
            return slope;
        }
        tb->saturated = 1;
        wanted = tb->least.most_q57;
    }
    if (tb->now.slope_q56 == 0 && arrived(tb->now.rate_q57, wanted)) {
        tb->now.rate_q57 = wanted;
        return 0;
    }
    renew_bounds(tb);
    plan(tb, wanted);
    return rate_next_slope(&tb->now, tb->plan_target_q57, &tb->plan);
}
