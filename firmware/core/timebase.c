/* SPDX-License-Identifier: MIT */
#include "core/timebase.h"

#include "core/qmath.h"
#include "core/timebase_private.h"

static void set_period(struct timebase *tb, uint32_t period_us)
{
    uint64_t period = (uint64_t)period_us << 36;
    tb->period_us = period_us;
    tb->period_log2 = (period_us >= 2000u ? 1u : 0u) + (period_us >= 4000u ? 1u : 0u) +
                      (period_us >= 8000u ? 1u : 0u);
    tb->period_q42_s = qmath_div_u64(period, TIMEBASE_REST_UNIT);
    tb->period_rest = (uint32_t)(period - tb->period_q42_s * TIMEBASE_REST_UNIT);
    tb->period_q32_s = (uint32_t)(tb->period_q42_s >> 10) + 1u;
    /* period_us 2^63 / 46875 in two steps */
    uint64_t high = qmath_div_u64((uint64_t)period_us << 48, 46875u);
    uint64_t left = ((uint64_t)period_us << 48) - high * 46875u;
    tb->sixth_q70_s = (high << 15) + qmath_div_u64(left << 15, 46875u);
}

static void set_least(struct timebase *tb)
{
    rate_bounds_of(&tb->least, tb->program, 0, tb->program->header.piece_count);
    tb->least_q57 = (int64_t)tb->least.factor_q14 << 43;
}

static void set_piece(struct timebase *tb)
{
    const struct program *p = tb->program;
    tb->piece = 0;
    tb->record = p->prepared_for != NULL ? prepared_piece_at(p, p->prepared_for, 0) : NULL;
    tb->piece_end_q42_s = timebase_end_q42_s(tb, program_piece_duration(p, 0) << TIMEBASE_FINE);
}

void timebase_begin_at(struct timebase *tb, const struct program *p, uint32_t period_us,
                       uint64_t time_q42_s)
{
    tb->program = p;
    tb->duration_q42_s = p->header.duration_q32_s << TIMEBASE_FINE;
    tb->time_q42_s = time_q42_s < tb->duration_q42_s ? time_q42_s : tb->duration_q42_s;
    tb->rest = 0;
    tb->fine = 0;
    set_period(tb, period_us);
    set_least(tb);
    tb->started = 0;
    tb->state = tb->time_q42_s == tb->duration_q42_s ? TIMEBASE_ENDED : TIMEBASE_RUNNING;
    set_piece(tb);
    if (tb->state != TIMEBASE_ENDED && tb->time_q42_s >= tb->piece_end_q42_s) {
        timebase_find_piece(tb, tb->time_q42_s, UINT32_MAX);
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

void timebase_rise_no_more(struct timebase *tb)
{
    if (tb->plan.move.step_q56 > 0) {
        rate_move_cut(&tb->plan.move);
    }
}

void timebase_go_from(struct timebase *tb, uint64_t time_q42_s, uint32_t piece,
                      const struct prepared_piece *record, uint64_t piece_end_q32_s)
{
    tb->time_q42_s = time_q42_s;
    tb->rest = 0;
    tb->fine = 0;
    tb->started = 1;
    tb->piece = piece;
    tb->record = record;
    tb->piece_end_q42_s = timebase_end_q42_s(tb, piece_end_q32_s << TIMEBASE_FINE);
    tb->steady = 0;
    tb->saturated = 0;
    tb->even_q62_s = 0;
    tb->now.rate_q57 = 0;
    tb->now.slope_q56 = 0;
    rate_plan_reset(&tb->plan);
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

uint64_t timebase_time_q42(const struct timebase *tb)
{
    return timebase_rounded_q42(tb);
}

uint64_t timebase_step(struct timebase *tb)
{
    return (timebase_step_q42(tb) + 512u) >> 10;
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
