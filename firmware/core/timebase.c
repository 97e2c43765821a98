/* SPDX-License-Identifier: MIT */
#include "core/timebase.h"

#include <stddef.h>

#include "core/prepared.h"
#include "core/qmath.h"

#define REST_UNIT 15625u /* 10^6 = 15625 * 2^6: periods in 2^-42 s are multiples of 1/15625 */
#define FINE_BITS 20
#define FINE      10 /* from q32 to q42 */
#define MOST_ENDS 2u /* piece ends in a tick, protocol.md 1.3 */

static void set_period(struct timebase *tb, uint32_t period_us)
{
    uint64_t period = (uint64_t)period_us << 36;
    tb->period_us = period_us;
    tb->period_q42_s = qmath_div_u64(period, REST_UNIT);
    tb->period_rest = (uint32_t)(period - tb->period_q42_s * REST_UNIT);
    tb->period_q32_s = (uint32_t)(tb->period_q42_s >> 10) + 1u;
    /* period_us 2^63 / 46875 in two steps */
    uint64_t high = qmath_div_u64((uint64_t)period_us << 48, 46875u);
    uint64_t left = ((uint64_t)period_us << 48) - high * 46875u;
    tb->sixth_q70_s = (high << 15) + qmath_div_u64(left << 15, 46875u);
}

static void set_least(struct timebase *tb)
{
    struct rate_bounds bounds;
    rate_bounds_of(&bounds, tb->program, 0, tb->program->header.piece_count);
    rate_pace_make(&tb->least, &bounds, tb->period_us);
    tb->least_q57 = (int64_t)tb->least.factor_q24 << 33;
}

/* The last piece ends with the program. */
static uint64_t end_q42_s(const struct timebase *tb, uint64_t end_q42)
{
    return tb->piece + 1u == tb->program->header.piece_count ? tb->duration_q42_s : end_q42;
}

static void set_piece(struct timebase *tb)
{
    const struct program *p = tb->program;
    tb->piece = 0;
    tb->record = p->prepared_for != NULL ? prepared_piece_at(p, p->prepared_for, 0) : NULL;
    tb->piece_end_q42_s = end_q42_s(tb, program_piece_duration(p, 0) << FINE);
}

static void read_ends(struct timebase *tb, uint32_t most)
{
    for (; tb->time_q42_s >= tb->piece_end_q42_s && most > 0; most--) {
        tb->piece++;
        uint64_t length_q32_s = program_piece_duration(tb->program, tb->piece);
        tb->piece_end_q42_s = end_q42_s(tb, tb->piece_end_q42_s + (length_q32_s << FINE));
    }
}

/* The present time is not in the present piece, nor at the end of the program: goes to the one that it is in, crossing
 * `most` ends at most. The record of the last one has no end. */
static void find_piece(struct timebase *tb, uint32_t most)
{
    const struct prepared_piece *record = tb->record;
    const uint64_t time_q32_s = tb->time_q42_s >> FINE;
    uint32_t left = most;
    if (record == NULL) {
        read_ends(tb, most);
        return;
    }
    do {
        record = prepared_piece_next(record, tb->program->prepared_for);
        left--;
    } while (time_q32_s >= record->end_q32_s && left > 0);
    tb->record = record;
    tb->piece += most - left;
    tb->piece_end_q42_s = end_q42_s(tb, record->end_q32_s << FINE);
}

void timebase_begin_at(struct timebase *tb, const struct program *p, uint32_t period_us,
                       uint64_t time_q42_s)
{
    tb->program = p;
    tb->duration_q42_s = p->header.duration_q32_s << FINE;
    tb->time_q42_s = time_q42_s < tb->duration_q42_s ? time_q42_s : tb->duration_q42_s;
    tb->rest = 0;
    tb->fine = 0;
    set_period(tb, period_us);
    set_least(tb);
    tb->started = 0;
    tb->state = tb->time_q42_s == tb->duration_q42_s ? TIMEBASE_ENDED : TIMEBASE_RUNNING;
    set_piece(tb);
    if (tb->state != TIMEBASE_ENDED && tb->time_q42_s >= tb->piece_end_q42_s) {
        find_piece(tb, UINT32_MAX);
    }
    tb->steady = 0;
    tb->saturated = 0;
    tb->even_q62_s = 0;
    tb->now.rate_q57 = 0;
    tb->now.slope_q56 = 0;
    tb->override_q57 = RATE_ONE;
    rate_plan_reset(&tb->plan);
}

void timebase_begin(struct timebase *tb, const struct program *p, uint32_t period_us)
{
    timebase_begin_at(tb, p, period_us, 0);
}

static void set_state(struct timebase *tb, enum timebase_state state)
{
    tb->state = state;
    tb->steady = 0;
}

void timebase_hold(struct timebase *tb)
{
    if (tb->state == TIMEBASE_RUNNING) {
        set_state(tb, TIMEBASE_HOLDING);
    }
}

void timebase_resume(struct timebase *tb)
{
    if (tb->state == TIMEBASE_HOLDING || tb->state == TIMEBASE_HELD) {
        set_state(tb, TIMEBASE_RUNNING);
    }
}

void timebase_override(struct timebase *tb, uint32_t percent)
{
    uint32_t used = percent < TIMEBASE_MOST_PERCENT ? percent : TIMEBASE_MOST_PERCENT;
    tb->override_q57 = (int64_t)qmath_div_u64(((uint64_t)RATE_ONE >> 2) * used, 25u);
    tb->steady = 0;
}

void timebase_stop(struct timebase *tb)
{
    if (tb->state == TIMEBASE_RUNNING || tb->state == TIMEBASE_HOLDING) {
        set_state(tb, TIMEBASE_STOPPING);
    } else if (tb->state == TIMEBASE_HELD) {
        set_state(tb, TIMEBASE_STOPPED);
    }
}

/* A program begins with feed and acceleration zero: there the rate may jump. */
static void step_first(struct timebase *tb)
{
    tb->started = 1;
    if (tb->time_q42_s == 0 && tb->state == TIMEBASE_RUNNING) {
        tb->now.rate_q57 = tb->override_q57 < RATE_ONE ? tb->override_q57 : RATE_ONE;
        tb->steady = tb->now.rate_q57 == RATE_ONE && rate_plan_steady(tb) != 0 ? 1u : 0u;
    }
}

/* A tick at rate 1, exact. */
static void advance_period(struct timebase *tb)
{
    tb->time_q42_s += tb->period_q42_s;
    tb->rest += tb->period_rest;
    if (tb->rest >= REST_UNIT) {
        tb->rest -= REST_UNIT;
        tb->time_q42_s++;
    }
}

static void advance_q62(struct timebase *tb, uint64_t way_q62_s)
{
    uint64_t sum = tb->fine + way_q62_s;
    tb->time_q42_s += sum >> FINE_BITS;
    tb->fine = (uint32_t)sum & ((1u << FINE_BITS) - 1u);
}

/* Integral of the rate over the tick: 6 times its mean is 3 rate + 2 slope + next slope. */
static uint64_t way_q62_s(const struct timebase *tb, int64_t slope_q56)
{
    int64_t six_q56 = 3 * tb->now.rate_q57 + 2 * tb->now.slope_q56 + slope_q56;
    int64_t way = qmath_mul_unsigned(six_q56, (uint32_t)(tb->sixth_q70_s >> 32)) +
                  (qmath_mul_unsigned(six_q56, (uint32_t)tb->sixth_q70_s) >> 32);
    return (uint64_t)(way > 0 ? way : 0);
}

/* At rest the way of one tick is that of the next. */
static void advance(struct timebase *tb, int64_t slope_q56)
{
    if (tb->now.slope_q56 != 0 || slope_q56 != 0) {
        advance_q62(tb, way_q62_s(tb, slope_q56));
        tb->even_q62_s = 0;
        return;
    }
    if (tb->now.rate_q57 == RATE_ONE) {
        advance_period(tb);
    } else {
        tb->even_q62_s = tb->even_q62_s != 0 ? tb->even_q62_s : way_q62_s(tb, 0);
        advance_q62(tb, tb->even_q62_s);
    }
    tb->steady = rate_plan_steady(tb) != 0 ? 1u : 0u;
}

static void end(struct timebase *tb)
{
    tb->time_q42_s = tb->duration_q42_s;
    tb->rest = 0;
    tb->fine = 0;
    tb->state = TIMEBASE_ENDED;
    tb->steady = 0;
}

static void pass_end(struct timebase *tb)
{
    if (tb->time_q42_s >= tb->duration_q42_s) {
        end(tb);
    } else {
        find_piece(tb, MOST_ENDS);
    }
}

/* Nothing is on its way: the same again. */
static void step_steady(struct timebase *tb)
{
    if (tb->now.rate_q57 == RATE_ONE) {
        advance_period(tb);
    } else {
        advance_q62(tb, tb->even_q62_s);
    }
    if (tb->time_q42_s >= tb->piece_end_q42_s) {
        pass_end(tb);
    }
}

static void come_to_rest(struct timebase *tb)
{
    if (tb->now.rate_q57 == 0 && tb->now.slope_q56 == 0) {
        tb->state = tb->state == TIMEBASE_STOPPING  ? TIMEBASE_STOPPED
                    : tb->state == TIMEBASE_HOLDING ? TIMEBASE_HELD
                                                    : tb->state;
    }
}

static void step(struct timebase *tb)
{
    if (tb->started == 0) {
        step_first(tb);
    } else if (tb->state == TIMEBASE_ENDED || tb->state == TIMEBASE_STOPPED) {
        tb->now.rate_q57 = 0;
        tb->now.slope_q56 = 0;
        return;
    } else {
        int64_t slope_q56 = rate_plan_slope(tb);
        advance(tb, slope_q56);
        rate_tick(&tb->now, slope_q56);
    }
    if (tb->time_q42_s >= tb->piece_end_q42_s) {
        pass_end(tb);
    }
    come_to_rest(tb);
}

uint64_t timebase_step_q42(struct timebase *tb)
{
    if (tb->steady != 0) {
        step_steady(tb);
    } else {
        step(tb);
    }
    return timebase_time_q42(tb);
}

uint64_t timebase_step(struct timebase *tb)
{
    return (timebase_step_q42(tb) + 512u) >> 10;
}

uint64_t timebase_time_q42(const struct timebase *tb)
{
    if (tb->fine == 0) {
        return tb->time_q42_s + (2u * tb->rest > REST_UNIT ? 1u : 0u);
    }
    uint64_t rest = ((uint64_t)tb->rest << FINE_BITS) + (uint64_t)tb->fine * REST_UNIT;
    uint64_t half = (uint64_t)REST_UNIT << (FINE_BITS - 1);
    return tb->time_q42_s + (rest > half ? 1u : 0u) + (rest > 3u * half ? 1u : 0u);
}

uint32_t timebase_rate_q30(const struct timebase *tb)
{
    int over = tb->state == TIMEBASE_ENDED || tb->state == TIMEBASE_STOPPED;
    return over ? 0u : (uint32_t)(tb->now.rate_q57 >> 27);
}

int timebase_saturated(const struct timebase *tb)
{
    return tb->saturated != 0;
}

enum timebase_state timebase_state(const struct timebase *tb)
{
    return (enum timebase_state)tb->state;
}
