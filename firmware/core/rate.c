/* SPDX-License-Identifier: MIT */
#include "core/rate.h"

#include "core/qmath.h"

static int64_t magnitude(int64_t a)
{
    return a < 0 ? -a : a;
}

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t clamp(int64_t a, int64_t low, int64_t high)
{
    return a < low ? low : a > high ? high : a;
}

struct rate_bounds rate_bounds_least(const struct rate_bounds *a, const struct rate_bounds *b)
{
    struct rate_bounds out = {
        .most_q57 = least(a->most_q57, b->most_q57),
        .slope_q56 = least(a->slope_q56, b->slope_q56),
        .second_q56 = least(a->second_q56, b->second_q56),
    };
    return out;
}

/* Greatest b with (1 + ceil(b / second)) b <= room: what is left of the way, b and all slopes after
 * it, when b falls to 0 evenly in ceil(b / second) ticks. */
static int64_t greatest_slope(int64_t room, int64_t second)
{
    uint64_t ratio = qmath_div_u64((uint64_t)room, (uint64_t)second);
    uint64_t n = qmath_root(ratio);
    n -= n * (n + 1u) > ratio ? 1u : 0u;
    return (int64_t)qmath_div_u64((uint64_t)room, n + 2u);
}

int64_t rate_next_slope(const struct rate *rate, int64_t target_q57,
                        const struct rate_bounds *bounds)
{
    int64_t room = target_q57 - rate->rate_q57 - rate->slope_q56;
    int64_t wanted = greatest_slope(magnitude(room), bounds->second_q56);
    wanted = clamp(room < 0 ? -wanted : wanted, -bounds->slope_q56, bounds->slope_q56);
    return clamp(wanted, rate->slope_q56 - bounds->second_q56,
                 rate->slope_q56 + bounds->second_q56);
}

void rate_move(struct rate *rate, int64_t slope_q56)
{
    rate->rate_q57 += rate->slope_q56 + slope_q56;
    rate->slope_q56 = slope_q56;
}

/* floor(a / b) of numbers that are not negative */
static int64_t quotient(int64_t a, int64_t b)
{
    return (int64_t)qmath_div_u64((uint64_t)a, (uint64_t)b);
}

struct rate_stop rate_stop(const struct rate *rate, int64_t second_q56)
{
    struct rate_stop stop = {.ticks = 0, .rest_q57 = rate->rate_q57};
    const int64_t slope = magnitude(rate->slope_q56);
    if (slope != 0) {
        stop.ticks = quotient(slope - 1, second_q56) + 1;
        int bits = 128 - qmath_clz64((uint64_t)stop.ticks) - qmath_clz64((uint64_t)slope);
        int64_t way = bits > 60 ? (int64_t)1 << 60 : stop.ticks * slope;
        stop.rest_q57 += rate->slope_q56 < 0 ? -way : way;
    }
    return stop;
}

/* Ticks from rest to rest over a way in rate units, at most (section 12, "How long it takes"). */
static int64_t way_ticks(int64_t way_q57, const struct rate_bounds *bounds)
{
    if (way_q57 == 0) {
        return 0;
    }
    int64_t corner = (int64_t)qmath_root((uint64_t)quotient(way_q57 / 2, bounds->second_q56)) + 1;
    if (corner * bounds->second_q56 <= bounds->slope_q56) {
        return 2 * corner + 2;
    }
    return quotient(way_q57 / 2, bounds->slope_q56) +
           quotient(bounds->slope_q56, bounds->second_q56) + 5;
}

int64_t rate_span_q12(const struct rate *rate, const struct rate_stop *stop, int64_t target_q57,
                      const struct rate_bounds *bounds)
{
    int64_t rest = clamp(stop->rest_q57, -RATE_ONE, 2 * RATE_MOST);
    int64_t away = magnitude(rest - rate->rate_q57);
    int64_t ticks = stop->ticks + way_ticks(magnitude(target_q57 - rate->rate_q57) + away, bounds);
    if (ticks >= RATE_SPAN_TICKS) {
        return INT64_MAX;
    }
    int64_t high = rate->rate_q57 > target_q57 ? rate->rate_q57 : target_q57;
    high = rest > high ? rest : high;
    /* from rest the way is even: its mean is the middle of both ends */
    int64_t mean = rate->slope_q56 == 0 ? (rate->rate_q57 + target_q57) / 2 : high;
    return ticks * ((mean >> 45) + 1) + 3 * ((high >> 45) + 1);
}
