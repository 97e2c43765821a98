/* SPDX-License-Identifier: MIT */
#include "core/rate_plan.h"

#define HIGHEST (RATE_WINDOW_LEVELS - 1u)

static int64_t greater(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static void get_window(const struct timebase *tb, uint32_t level, struct rate_window *w)
{
    rate_window_get(w, &tb->scale, tb->program, tb->piece, tb->piece_end_q32_s, level);
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
static int keeps(const struct rate *now, const struct rate_stop *stop, int64_t target_q57,
                 const struct rate_bounds *bounds)
{
    int64_t high = greater(greater(now->rate_q57, stop->rest_q57), target_q57);
    return stop->rest_q57 >= 0 && high <= bounds->most_q57 && now->slope_q56 <= bounds->slope_q56 &&
           now->slope_q56 >= -bounds->slope_q56;
}

enum found { FOUND, NONE, NOT_YET };

/* Bounds with which the target can be reached from here inside all pieces on the way. One window a tick; a wider one in
 * the next. */
static enum found find_bounds(struct timebase *tb, int64_t target_q57, struct rate_bounds *out)
{
    struct rate_window w;
    get_window(tb, tb->plan_level, &w);
    struct rate_stop stop = rate_stop(&tb->now, w.bounds.second_q56);
    if (keeps(&tb->now, &stop, target_q57, &w.bounds)) {
        *out = w.bounds;
        if (reached_q32(tb, rate_span_q12(&tb->now, &stop, target_q57, out)) <= w.end_q32_s) {
            return FOUND;
        }
        if (tb->plan_level < HIGHEST) {
            tb->plan_level++;
            return NOT_YET;
        }
    }
    *out = tb->least;
    stop = rate_stop(&tb->now, out->second_q56);
    return keeps(&tb->now, &stop, target_q57, out) ? FOUND : NONE;
}

static void plan(struct timebase *tb, int64_t target_q57)
{
    struct rate_bounds bounds;
    int renewed = tb->plan_target_q57 == target_q57;
    if (renewed && tb->plan_piece == tb->piece) {
        return;
    }
    if (tb->plan_next_q57 != target_q57) {
        tb->plan_next_q57 = target_q57;
        tb->plan_level = 0;
    }
    enum found found = find_bounds(tb, target_q57, &bounds);
    if (found == NOT_YET) {
        return;
    }
    tb->plan_level = 0;
    tb->plan_piece = tb->piece;
    if (found == NONE) {
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
    struct rate_stop stop; /* from there */
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
    a->stop = rate_stop(&a->after, bounds->second_q56);
    a->back_q57 = a->stop.rest_q57 < tb->least.most_q57 ? a->stop.rest_q57 : tb->least.most_q57;
    int64_t inside = now->rate_q57 + greater(now->slope_q56, 0);
    return inside <= bounds->most_q57 && now->slope_q56 <= bounds->slope_q56 &&
           now->slope_q56 >= -bounds->slope_q56 && keeps(&a->after, &a->stop, a->back_q57, bounds);
}

/* Slopes move the rate by even steps near the target: the last unit may be left over. */
static int arrived(int64_t rate_q57, int64_t target_q57)
{
    return rate_q57 - target_q57 <= 1 && target_q57 - rate_q57 <= 1;
}

/* A tick that has been shown to be safe becomes the plan. */
static void take(struct timebase *tb, const struct attempt *a, const struct rate_window *w,
                 uint64_t reached_q32_s)
{
    int still = a->after.slope_q56 == 0 && arrived(a->after.rate_q57, a->target_q57) &&
                tb->now.slope_q56 == 0;
    uint64_t way = reached_q32_s - (tb->time_q42_s >> 10);
    tb->climb_end_q32_s = still && w->end_q32_s > way ? w->end_q32_s - way : 0;
    tb->plan = w->bounds;
    tb->plan_target_q57 = a->back_q57;
    tb->plan_piece = tb->piece;
    tb->saturated = a->target_q57 < tb->override_q57;
}

/* A narrower window next time, if it would do with room for some ticks. */
static void narrow(struct timebase *tb, uint64_t reached_q32_s, uint64_t margin)
{
    struct rate_window w;
    if (tb->climb_level > 0) {
        get_window(tb, tb->climb_level - 1u, &w);
        tb->climb_level -= reached_q32_s + 2u * margin <= w.end_q32_s ? 1u : 0u;
    }
}

static int64_t follow(const struct timebase *tb)
{
    return rate_next_slope(&tb->now, tb->plan_target_q57, &tb->plan);
}

/* No attempt before the first piece that may be the one in the way. */
static void give_up(struct timebase *tb)
{
    tb->climb_piece = tb->piece + (tb->climb_level > 1u ? 1u << (tb->climb_level - 1u) : 1u);
    tb->climb_end_q32_s = 0;
    tb->climb_level = 0;
}

/* A tick above the least factor, or along the plan when its window shows no way back. */
static int64_t climb(struct timebase *tb)
{
    struct rate_window w;
    struct attempt a;
    uint64_t margin = 4u * (uint64_t)tb->period_q32_s;
    uint64_t reached = UINT64_MAX;
    if ((tb->time_q42_s >> 10) + margin <= tb->climb_end_q32_s) {
        return 0;
    }
    get_window(tb, tb->climb_level, &w);
    int possible = try_tick(tb, &w.bounds, &a);
    if (possible != 0) {
        reached = reached_q32(tb, rate_span_q12(&a.after, &a.stop, a.back_q57, &w.bounds)) + margin;
    }
    if (possible != 0 && reached <= w.end_q32_s) {
        take(tb, &a, &w, reached);
        narrow(tb, reached, margin);
        return a.after.slope_q56;
    }
    if (possible != 0 && tb->climb_level < HIGHEST) {
        tb->climb_level++;
    } else {
        give_up(tb);
    }
    tb->saturated = 1;
    return follow(tb);
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

int64_t rate_plan_slope(struct timebase *tb)
{
    int64_t wanted = wanted_rate(tb);
    tb->saturated = tb->saturated != 0 && wanted > tb->least.most_q57;
    if (wanted > tb->least.most_q57) {
        if (tb->piece >= tb->climb_piece) {
            return climb(tb);
        }
        tb->saturated = 1;
        wanted = tb->least.most_q57;
    }
    if (tb->now.slope_q56 == 0 && arrived(tb->now.rate_q57, wanted)) {
        tb->now.rate_q57 = wanted;
        return 0;
    }
    plan(tb, wanted);
    return follow(tb);
}
