/* SPDX-License-Identifier: MIT */
/*
 * One tick of the program clock and of the plan of the feed override, for any program of three pieces, at any time in
 * each piece, after any command: nothing overflows, and the look-ahead reads no piece after the last one. What the plan
 * decides: cbmc_plan.c. Which piece the clock is in: cbmc_ends.c. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 10
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/program_clock.h: program_clock_find_piece(clock, time_q42_s, PROGRAM_CLOCK_MOST_ENDS); => (void)program_clock_find_piece;
 * assumes: qmath_div_u64 override_bounds_of begin_from_0 next_slope tick_of_decision comes_steady
 * shows: override_window_get override_plan_begin override_plan_restart override_plan_hold override_plan_release override_plan_set override_plan_tick program_clock_set
 * mutant: core/override_plan.c: clock->record->ahead[window] => clock->record->ahead[window + 1u]
 * mutant: core/override_plan.c: qmath_lesser(plan->requested_q57, most_q57) => plan->requested_q57 + most_q57
 * mutant: core/program_clock.c: 3 * from->override_q57 => 64 * from->override_q57
 */
#include "core/override_plan.h"
#include "ramp_contracts.h"
#include "proof.h"
#include "qmath_contracts.h"

/*@ predicate is_plan(struct override_plan *plan) =
      IS_OVERRIDE(plan->now.override_q57) && -OVERRIDE_MOST <= plan->now.slope_q56 <= OVERRIDE_MOST &&
      IS_OVERRIDE(plan->commanded_q57) && OVERRIDE_ONE <= plan->guaranteed_q57 <= OVERRIDE_MOST; */

/*@ assigns plan->now, plan->ramp, plan->steady, plan->saturated, plan->task, plan->searched, plan->wanted_q57,
            plan->return_q32_s \from \nothing;
    ensures plan->now.override_q57 == 0 && plan->now.slope_q56 == 0 && plan->steady == 0;
    ensures \initialized(&plan->ramp); */
static void begin_from_0(struct override_plan *plan);

/*@ requires is_plan(plan);
    assigns \result, plan->ramp, plan->task, plan->kind, plan->step, plan->window, plan->target_q57 \from plan->now.override_q57;
    ensures -OVERRIDE_MOST <= \result <= OVERRIDE_MOST; */
static int64_t next_slope(struct override_plan *plan, const struct program_clock *clock);

/*@ requires is_plan(plan);
    assigns plan->ramp, plan->now.override_q57, plan->saturated, plan->task \from plan->now.override_q57;
    ensures IS_OVERRIDE(plan->now.override_q57); */
static void tick_of_decision(struct override_plan *plan, const struct program_clock *clock);

/*@ requires is_plan(plan);
    assigns \result, plan->task, plan->searched, plan->saturated, plan->steady \from plan->now.override_q57;
    ensures \result == 0 || \result == 1; */
static int comes_steady(struct override_plan *plan);

#include "core/override_plan.c"
#include "core/program_clock.c"

#define COUNT 3u

static uint64_t records[COUNT * sizeof(struct coefficients_piece) / 8];

static const struct kernel any_kernel = {.piece_size = sizeof(struct feed_piece)};

/* Overrides up to OVERRIDE_MOST, slopes up to a whole change: cbmc_plan.c. */
static void set_override(struct override_plan *plan)
{
    plan->now.override_q57 = any_between(0, OVERRIDE_MOST);
    plan->now.slope_q56 = any_between(-OVERRIDE_MOST, OVERRIDE_MOST);
}

static uint32_t any_period(void)
{
    return (uint32_t)1000 << any_between(0, 3);
}

static void command(struct override_plan *plan)
{
    switch (any_between(0, 3)) {
    case 0:
        override_plan_hold(plan);
        break;
    case 1:
        override_plan_release(plan);
        break;
    case 2:
        override_plan_set(plan, (uint32_t)any_between(0, UINT32_MAX));
        break;
    default:
        break;
    }
}

/* In piece i: its end is beyond the present time. */
static void place(struct program_clock *clock, uint32_t i)
{
    const struct program *p = clock->program;
    clock->time_q42_s = (uint64_t)any_between(0, INT64_MAX);
    clock->piece = i;
    clock->record = coefficients_piece_at(p, p->coefficients_for, i);
    clock->remainder = (uint32_t)any_between(0, PROGRAM_CLOCK_REMAINDER_UNIT - 1);
    clock->fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
}

static void look_ahead(const struct program_clock *clock)
{
    struct override_window w;
    //@ loop unroll 5;
    for (uint32_t window = 0; window < OVERRIDE_WINDOWS; window++) {
        override_window_get(&w, clock, window);
        const struct program_override bounds = *w.bounds;
        prove(IS_FACTOR(bounds.factor_q14));
    }
}

static void tick(const struct program *p)
{
    struct program_clock clock;
    struct override_plan plan;
    program_clock_begin(&clock, p, any_period(), 0);
    override_plan_begin(&plan, p);
    plan.ramp.rise = (uint32_t)any_between(0, MOST_HALF);
    //@ loop unroll 3;
    for (uint32_t i = 0; i < COUNT; i++) {
        set_override(&plan);
        place(&clock, i);
        look_ahead(&clock);
        command(&plan);
        plan.steady = (uint32_t)any_between(0, 1);
        plan.started = (uint32_t)any_between(0, 1);
        override_plan_tick(&plan, &clock);
        program_clock_set(&clock, (uint64_t)any_between(0, INT64_MAX), i,
                          coefficients_piece_at(p, p->coefficients_for, i));
        override_plan_restart(&plan);
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
    Frama_C_make_unknown((char *)records, sizeof records);
    p.coefficients = (const uint8_t *)records;
    p.coefficients_for = &any_kernel;
    for (uint32_t i = 0; i < COUNT; i++) {
        struct coefficients_piece *record = (void *)coefficients_piece_at(&p, &any_kernel, i);
        record->next = i + 1 == COUNT ? 0 : (int32_t)sizeof *record;
        record->number = i;
        record->end_q42_s = i + 1 == COUNT ? UINT64_MAX : (uint64_t)any_between(INT64_MIN, INT64_MAX);
        for (uint32_t k = 0; k < OVERRIDE_WINDOWS; k++) {
            record->ahead[k] = any_bounds();
        }
    }
    tick(&p);
    reached();
    return 0;
}
