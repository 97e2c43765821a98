/* SPDX-License-Identifier: MIT */
#include "core/qmath.h"
#include "core/timebase.h"
#include "core/timebase_private.h"

/* Integral of the rate over the tick: 6 times its mean is 3 rate + 2 slope + next slope. */
static uint64_t way_q62_s(const struct timebase *tb, int64_t slope_q56)
{
    int64_t six_q56 = 3 * tb->now.rate_q57 + 2 * tb->now.slope_q56 + slope_q56;
    int64_t way = qmath_mul_unsigned(six_q56, (uint32_t)(tb->sixth_q70_s >> 32)) +
                  (qmath_mul_unsigned(six_q56, (uint32_t)tb->sixth_q70_s) >> 32);
    return (uint64_t)(way > 0 ? way : 0);
}

/* Time stands still. */
static void come_to_rest(struct timebase *tb)
{
    tb->state = tb->state == TIMEBASE_STOPPING  ? TIMEBASE_STOPPED
                : tb->state == TIMEBASE_HOLDING ? TIMEBASE_HELD
                                                : tb->state;
}

/* A program begins with feed and acceleration zero: there the rate may jump. */
uint64_t timebase_start(struct timebase *tb)
{
    tb->started = 1;
    if (tb->time_q42_s != 0 || tb->state != TIMEBASE_RUNNING) {
        if (tb->now.rate_q57 == 0) {
            come_to_rest(tb);
        }
    } else if (tb->override_q57 >= RATE_ONE) {
        tb->now.rate_q57 = RATE_ONE;
        tb->steady = rate_plan_steady(tb) != 0 ? 1u : 0u;
    } else {
        tb->now.rate_q57 = tb->override_q57;
        tb->even_q62_s = way_q62_s(tb, 0);
    }
    return tb->time_q42_s;
}

/* The rate is on its way. The tick that brings it to rest looks how far each tick there will go. */
static void step_moving(struct timebase *tb)
{
    int64_t slope_q56 = rate_plan_move(tb);
    timebase_advance_q62(tb, way_q62_s(tb, slope_q56));
    rate_tick(&tb->now, slope_q56);
    if (!rate_moves(&tb->plan.move)) {
        tb->even_q62_s = way_q62_s(tb, 0);
        if (tb->now.rate_q57 == 0) {
            come_to_rest(tb);
        }
    }
}

static void step_resting(struct timebase *tb)
{
    if (rate_plan_steady(tb)) {
        tb->steady = 1;
    } else {
        rate_plan_decide(tb);
    }
    if (tb->now.rate_q57 != 0) {
        timebase_advance_even(tb);
    } else {
        come_to_rest(tb);
    }
}

void timebase_change(struct timebase *tb)
{
    if (tb->state == TIMEBASE_ENDED || tb->state == TIMEBASE_STOPPED) {
        tb->now.rate_q57 = 0;
        tb->now.slope_q56 = 0;
    } else if (rate_moves(&tb->plan.move)) {
        step_moving(tb);
    } else {
        step_resting(tb);
    }
}
