/* SPDX-License-Identifier: MIT */
/*
 * A tick of the timebase, for any program of three pieces, with records and without, wherever its time is and after any
 * command: nothing overflows, no window asks for what is behind the last piece. The rate: cbmc_plan.c. Which piece it is in: cbmc_ends.c.
 *
 * prover: eva
 * options: -eva-slevel 10
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/timebase_step.c: timebase_find_piece(tb, time_q42_s, TIMEBASE_MOST_ENDS); => (void)timebase_find_piece;
 * assumes: qmath_div_u64 program_piece_duration rate_bounds_of rate_plan_reset rate_plan_move rate_plan_decide rate_plan_steady
 * shows: rate_window_get timebase_hold timebase_resume timebase_override timebase_go_from timebase_step_q42 timebase_time_q42 timebase_rate_q30 timebase_saturated timebase_state
 * mutant: core/rate_window.c: behind < left ? behind : left => behind
 * mutant: core/rate_window.c: last + 1u - tb->piece => last - tb->piece
 * mutant: core/timebase.c: percent < TIMEBASE_MOST_PERCENT ? percent => percent < 2 * TIMEBASE_MOST_PERCENT ? percent
 * mutant: core/timebase_change.c: 3 * tb->now.rate_q57 => 64 * tb->now.rate_q57
 */
#include "core/timebase.h"
#include "proof.h"
#include "qmath_contracts.h"
#include "rate_contracts.h"

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 < \result <= (1 << 54); */
uint64_t program_piece_duration(const struct program *p, uint32_t i);

/*@ assigns *plan \from \nothing;
    ensures \initialized(plan); */
void rate_plan_reset(struct rate_plan *plan);

/*@ predicate is_timebase(struct timebase *tb) =
      IS_RATE(tb->now.rate_q57) && -RATE_MOST <= tb->now.slope_q56 <= RATE_MOST && IS_RATE(tb->override_q57) &&
      RATE_ONE <= tb->least_q57 <= RATE_MOST && tb->state <= TIMEBASE_HELD; */

/*@ requires is_timebase(tb);
    assigns \result, tb->plan \from tb->now.rate_q57;
    ensures -RATE_MOST <= \result <= RATE_MOST; */
int64_t rate_plan_move(struct timebase *tb);

/*@ requires is_timebase(tb);
    assigns tb->plan, tb->now.rate_q57, tb->saturated \from tb->now.rate_q57;
    ensures IS_RATE(tb->now.rate_q57); */
void rate_plan_decide(struct timebase *tb);

/*@ requires is_timebase(tb);
    assigns \result, tb->plan.task, tb->plan.searched, tb->saturated \from tb->now.rate_q57;
    ensures \result == 0 || \result == 1; */
int rate_plan_steady(struct timebase *tb);

#include "core/rate_window.c"
#include "core/timebase.c"
#include "core/timebase_change.c"
#include "core/timebase_step.c"

#define COUNT 3u

static uint64_t records[COUNT * sizeof(struct prepared_piece) / 8];

static const struct kernel any_kernel = {.piece_size = sizeof(struct feed_piece)};

/* Rates up to RATE_MOST, slopes up to a whole way: cbmc_plan.c. */
static void set_rate(struct timebase *tb)
{
    tb->now.rate_q57 = any_between(0, RATE_MOST);
    tb->now.slope_q56 = any_between(-RATE_MOST, RATE_MOST);
}

static uint32_t any_period(void)
{
    return (uint32_t)1000 << any_between(0, 3);
}

static void command(struct timebase *tb)
{
    switch (any_between(0, 4)) {
    case 0:
        timebase_hold(tb);
        break;
    case 1:
        timebase_resume(tb);
        break;
    case 2:
        timebase_stop(tb);
        break;
    case 3:
        timebase_override(tb, (uint32_t)any_between(0, UINT32_MAX));
        break;
    default:
        break;
    }
}

/* In piece i: its end is beyond the present time. */
static void place(struct timebase *tb, uint32_t i)
{
    const struct program *p = tb->program;
    tb->piece = i;
    tb->time_q42_s = (uint64_t)any_between(0, INT64_MAX);
    tb->piece_end_q42_s = timebase_end_q42_s(tb, (uint64_t)any_between(0, INT64_MAX));
    if (p->prepared_for != NULL) {
        tb->record = prepared_piece_at(p, p->prepared_for, i);
    }
    tb->rest = (uint32_t)any_between(0, TIMEBASE_REST_UNIT - 1);
    tb->fine = (uint32_t)any_between(0, (1 << TIMEBASE_FINE_BITS) - 1);
    tb->state = (uint32_t)any_between(0, 5);
    tb->steady = (uint32_t)any_between(0, 1);
    tb->started = (uint32_t)any_between(0, 1);
}

static void look_ahead(const struct timebase *tb)
{
    struct rate_window w;
    //@ loop unroll 5;
    for (uint32_t window = 0; window < RATE_WINDOWS; window++) {
        rate_window_get(&w, tb, window);
        const struct program_override bounds = *w.bounds;
        prove(IS_FACTOR(bounds.factor_q14));
    }
}

static void tick(const struct program *p)
{
    struct timebase tb;
    timebase_begin(&tb, p, any_period());
    //@ loop unroll 3;
    for (uint32_t i = 0; i < COUNT; i++) {
        set_rate(&tb);
        place(&tb, i);
        look_ahead(&tb);
        command(&tb);
        timebase_step_q42(&tb);
        timebase_rate_q30(&tb);
        timebase_go_from(&tb, (uint64_t)any_between(0, INT64_MAX), i, tb.record, (uint64_t)any_between(0, POWER(54)));
    }
}

static struct program_override any_bounds(void)
{
    struct program_override bounds;
    Frama_C_make_unknown((char *)&bounds, sizeof bounds);
    bounds.factor_q14 = (uint16_t)any_between(1 << 14, 1 << 15);
    return bounds;
}

int main(void)
{
    struct program p;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.header.piece_count = COUNT;
    p.header.duration_q32_s = (uint64_t)any_between(1, POWER(53));
    p.prepared = NULL;
    p.prepared_for = NULL;
    tick(&p);
    Frama_C_make_unknown((char *)records, sizeof records);
    p.prepared = (const uint8_t *)records;
    p.prepared_for = &any_kernel;
    for (uint32_t i = 0; i < COUNT; i++) {
        struct prepared_piece *record = (void *)prepared_piece_at(&p, &any_kernel, i);
        record->end_q32_s = i + 1 == COUNT ? UINT64_MAX : (uint64_t)any_between(1, POWER(54));
        for (uint32_t k = 0; k < RATE_WINDOWS; k++) {
            record->ahead[k] = any_bounds();
        }
    }
    tick(&p);
    reached();
    return 0;
}
