/* SPDX-License-Identifier: MIT */
/*
 * The rate at rest: a tick that looks for a move, or begins one, leaves a sound plan (plan_is_sound.h), and so does a
 * reset.
 *
 * prover: cbmc
 * options: --unwind 6 --signed-overflow-check
 * replaces: override_ticks_of:some_ticks override_step_of:some_step override_span_q32:some_span override_window_get:some_window override_stage_of:some_stage override_limits_of:some_limits
 * shows: rate_plan_decide rate_plan_reset rate_plan_steady
 * mutant: core/override_plan.c: down ? -step_q56 : step_q56 => step_q56
 * mutant: core/override_plan.c: tb->now.override_q57 > tb->least_q57 ? OVERRIDE_STAY : OVERRIDE_CLIMB => OVERRIDE_STAY
 * mutant: core/override_plan.c: magnitude(away) / 2 => magnitude(away)
 * mutant: core/override_plan.c: plan->back = plan->ticks; =>
 * mutant: core/override_plan.c: tb->plan.window < OVERRIDE_WINDOWS => tb->plan.window <= OVERRIDE_WINDOWS
 */
#include "plan_is_sound.h"

/* CBMC has none for 32-bit machines. */
void *memset(void *to, int value, size_t size)
{
    const struct override_plan none = {{0, 0, 0, 0, 0}, 0, 0, 0, 0, 0, 0, 0, {0, 0}, 0, {0, 0}};
    prove(value == 0 && size == sizeof none);
    *(struct override_plan *)to = none;
    return to;
}

/* Begun at rest: 2 d rise half, of which it may leave something, is at most the way that d was made for. */
static void begin(struct way *way, const struct override_ramp *m)
{
    prove(m->fall == 0 && m->rise <= MOST_HALF && m->even <= MOST_HALF);
    int64_t most = begun_q57 >= 0 ? begun_q57 : 2 * qmath_magnitude(m->step_q56);
    int64_t ahead = any_between(0, most);
    way->ahead = m->step_q56 < 0 ? -ahead : m->step_q56 > 0 ? ahead : 0;
}

static void at_rest(void)
{
    struct timebase tb;
    struct way way;
    any_timebase(&tb, &way);
    assume(!override_ramp_moves(&tb.plan.move));
    begun_q57 = -1;
    if (!rate_plan_steady(&tb)) {
        rate_plan_decide(&tb);
    }
    if (override_ramp_moves(&tb.plan.move)) {
        begin(&way, &tb.plan.move);
    }
    prove(is_sound(&tb, &way));
}

/* At time 0 the rate begins at up to 1, else at 0. */
static void first(void)
{
    struct timebase tb;
    struct way way = {0, 0, 0};
    assume(IS_FACTOR(tb.least.factor_q14));
    tb.least_q57 = (int64_t)tb.least.factor_q14 << 43;
    tb.now.override_q57 = any_between(0, OVERRIDE_ONE);
    tb.now.slope_q56 = 0;
    rate_plan_reset(&tb.plan);
    int steady = rate_plan_steady(&tb);
    prove(steady == 0 || steady == 1);
    prove(is_sound(&tb, &way));
}

void harness(void)
{
    at_rest();
    first();
    reached();
}
