/* SPDX-License-Identifier: MIT */
#include "core/timebase.h"

#include "core/qmath.h"

#define REST_UNIT  15625u /* 10^6 = 15625 * 2^6: periods in 2^-42 s are multiples of 1/15625 */
#define ONE_Q30    (1u << 30)
#define MOST_TICKS (1u << 20)

static uint32_t divide_up(uint64_t a, uint32_t b)
{
    uint64_t quotient = qmath_div_u64(a + b - 1u, b);
    return quotient > UINT32_MAX ? UINT32_MAX : (uint32_t)quotient;
}

static uint32_t root_up(uint32_t a)
{
    uint32_t root = 0;
    for (uint32_t bit = 1u << 15; bit != 0; bit >>= 1) {
        uint32_t next = root | bit;
        root = next * next <= a ? next : root;
    }
    return root * root < a ? root + 1u : root;
}

static uint32_t at_least(uint32_t a, uint32_t least)
{
    return a < least ? least : a;
}

/* slope >= 1/(rate h) and slope^2 >= 1/(second h^2); corner >= 1/(second h^2 slope): numerics.md
 * section 12. */
static void plan_stop(struct timebase *tb, uint32_t rate_q16, uint32_t second_q8,
                      uint32_t period_us)
{
    uint32_t per_rate = divide_up(UINT64_C(65536000000) / 1000u, period_us / 1000u);
    uint32_t per_second = 256000000u / (period_us / 1000u) / (period_us / 1000u);
    uint32_t by_rate = divide_up(per_rate, at_least(rate_q16, 1));
    uint32_t square = divide_up(per_second, at_least(second_q8, 1));
    uint32_t slope = at_least(by_rate, root_up(square));
    slope = slope > MOST_TICKS ? MOST_TICKS : slope;
    uint32_t corner = divide_up(square, slope);
    tb->slope_ticks = slope;
    tb->corner_ticks = corner > slope ? slope : corner;
    tb->unit_q62 = qmath_div_u64(qmath_div_u64(UINT64_C(1) << 62, 6u * slope), tb->corner_ticks);
}

void timebase_begin(struct timebase *tb, const struct program *p, uint32_t period_us)
{
    uint64_t period = (uint64_t)period_us << 36;
    struct program_piece piece;
    uint32_t rate = UINT32_MAX;
    uint32_t second = UINT32_MAX;
    for (uint32_t i = 0; i < p->header.piece_count; i++) {
        program_piece_get(p, i, &piece);
        rate = piece.override_rate_q16_per_s < rate ? piece.override_rate_q16_per_s : rate;
        second =
            piece.override_second_q8_per_s2 < second ? piece.override_second_q8_per_s2 : second;
    }
    tb->duration_q42_s = p->header.duration_q32_s << 10;
    tb->time_q42_s = 0;
    tb->rest = 0;
    tb->period_q42_s = qmath_div_u64(period, REST_UNIT);
    tb->period_rest = (uint32_t)(period - tb->period_q42_s * REST_UNIT);
    tb->period_q38_s = (uint32_t)((tb->period_q42_s + 8u) >> 4);
    tb->started = 0;
    tb->state = tb->duration_q42_s == 0 ? TIMEBASE_ENDED : TIMEBASE_RUNNING;
    tb->ramp_tick = 0;
    tb->rate_q30 = ONE_Q30;
    plan_stop(tb, rate, second, period_us);
}

void timebase_stop(struct timebase *tb)
{
    if (tb->state == TIMEBASE_RUNNING) {
        tb->state = TIMEBASE_STOPPING;
        tb->ramp_tick = 0;
    }
}

static void step_running(struct timebase *tb)
{
    tb->time_q42_s += tb->period_q42_s;
    tb->rest += tb->period_rest;
    if (tb->rest >= REST_UNIT) {
        tb->rest -= REST_UNIT;
        tb->time_q42_s++;
    }
}

/* Six times the increase of the integral of (n - from)^2 / 2 over tick n, from where it begins. */
static uint64_t corner_term(uint32_t n, uint32_t from)
{
    uint64_t x = n - from;
    return n >= from ? 3u * x * (x + 1u) + 1u : 0u;
}

/* Mean rate over ramp tick n: 1 - 6 dH / (6 slope corner), numerics.md section 12. */
static uint64_t ramp_rate_q62(const struct timebase *tb, uint32_t n)
{
    uint32_t slope = tb->slope_ticks;
    uint32_t corner = tb->corner_ticks;
    uint64_t fall = corner_term(n, 0) + corner_term(n, slope + corner);
    fall -= corner_term(n, corner) + corner_term(n, slope);
    return (UINT64_C(1) << 62) - fall * tb->unit_q62;
}

static void step_stopping(struct timebase *tb)
{
    uint64_t rate = ramp_rate_q62(tb, tb->ramp_tick);
    int64_t way_q68 = qmath_mul_unsigned((int64_t)rate, tb->period_q38_s);
    tb->time_q42_s += (uint64_t)way_q68 >> 26;
    tb->rate_q30 = (uint32_t)(rate >> 32);
    tb->ramp_tick++;
    if (tb->ramp_tick == tb->slope_ticks + tb->corner_ticks) {
        tb->state = TIMEBASE_STOPPED;
    }
}

uint64_t timebase_step(struct timebase *tb)
{
    if (tb->started == 0) {
        tb->started = 1;
    } else if (tb->state == TIMEBASE_RUNNING) {
        step_running(tb);
    } else if (tb->state == TIMEBASE_STOPPING) {
        step_stopping(tb);
    } else {
        tb->rate_q30 = 0;
    }
    if (tb->time_q42_s >= tb->duration_q42_s) {
        tb->time_q42_s = tb->duration_q42_s;
        tb->rest = 0;
        tb->state = TIMEBASE_ENDED;
    }
    return (tb->time_q42_s + 512u) >> 10;
}

uint64_t timebase_time_q42(const struct timebase *tb)
{
    return tb->time_q42_s + (2u * tb->rest > REST_UNIT ? 1u : 0u);
}

uint32_t timebase_rate_q30(const struct timebase *tb)
{
    return tb->rate_q30;
}

enum timebase_state timebase_state(const struct timebase *tb)
{
    return (enum timebase_state)tb->state;
}
