/* SPDX-License-Identifier: MIT */
#include "core/rate.h"

#include "core/qmath.h"

#define SHORT_TICKS 40u

void rate_ticks_of(struct rate_ticks *ticks, const struct rate_pace *pace, int64_t way_q57)
{
    const uint32_t way_q30 = (uint32_t)(way_q57 >> 27) + 1u;
    const int shift = qmath_clz32(way_q30) & ~1;
    const uint32_t root = qmath_root_above(way_q30 << shift);
    const uint32_t turns =
        ((uint32_t)(qmath_product_unsigned(root, pace->inverse_root) >> 32) >> (shift / 2)) + 1u;
    const uint32_t half =
        ((uint32_t)(qmath_product_unsigned(way_q30, pace->inverse_slope) >> 32) >> 3) + 1u;
    ticks->rise = turns < pace->turns ? turns : pace->turns;
    ticks->half = half > ticks->rise ? half : ticks->rise;
}

int64_t rate_step_of(const struct rate_ticks *ticks, int64_t way_q57)
{
    const uint64_t parts = qmath_product_unsigned(ticks->rise, ticks->half) << 1;
    return (int64_t)qmath_div_u64((uint64_t)way_q57, parts);
}

uint64_t rate_span_q32(const struct rate_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s)
{
    const uint32_t mean_q16 = (uint32_t)(mean_q57 >> 41) + 1u;
    const uint32_t tick_q32_s =
        (uint32_t)(qmath_product_unsigned(period_q32_s, mean_q16) >> 16) + 1u;
    return qmath_product_unsigned(ticks->rise + ticks->half, tick_q32_s);
}

void rate_move_begin(struct rate_move *move, const struct rate *from,
                     const struct rate_ticks *ticks, int64_t step_q56)
{
    move->step_q56 = step_q56;
    move->rest_q57 = from->rate_q57;
    move->rise = ticks->rise;
    move->even = ticks->half - ticks->rise;
    move->fall = 0;
}

void rate_move_shorten(struct rate_move *move)
{
    const uint32_t most = 2u * move->rise + SHORT_TICKS;
    move->even = move->even < most ? move->even : most;
}

void rate_move_cut(struct rate_move *move)
{
    move->rise = 0;
    move->even = 0;
}

/* A tick more of rise is one more of fall: twice what it raises the rate by. */
int64_t rate_move_slope(struct rate_move *move, int64_t slope_q56)
{
    int64_t next = slope_q56;
    if (move->rise > 0) {
        move->rise--;
        move->fall++;
        next += move->step_q56;
        move->rest_q57 += 2 * (slope_q56 + next);
    } else if (move->even > 0) {
        move->even--;
        move->rest_q57 += 2 * slope_q56;
    } else if (move->fall > 0) {
        move->fall--;
        next -= move->step_q56;
    }
    return next;
}
