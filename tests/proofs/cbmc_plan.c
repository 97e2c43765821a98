/* SPDX-License-Identifier: MIT */
/*
 * A constant override: a tick that searches a ramp, or begins one, leaves a sound plan (plan_is_sound.h), and so does a
 * reset. Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches
 * nothing.
 *
 * prover: cbmc
 * options: --unwind 6 --signed-overflow-check
 * replaces: override_ticks_of:some_ticks override_step_of:some_step override_span_q32:some_span override_window_get:some_window override_change_of:some_change override_stage_of:some_stage override_limits_of:some_limits
 * shows: tick_of_decision begin_from_0 comes_steady
 * mutant: core/override_plan.c: down ? -step_q56 : step_q56 => step_q56
 * mutant: core/override_plan.c: above ? OVERRIDE_STAY : OVERRIDE_CLIMB => OVERRIDE_STAY
 * mutant: core/override_plan.c: magnitude(change_q57) / 2 => magnitude(change_q57)
 * mutant: core/override_plan.c: plan->back = plan->ticks; =>
 * mutant: core/override_plan.c: plan->window < OVERRIDE_WINDOWS => plan->window <= OVERRIDE_WINDOWS
 * mutant: core/override_plan.c: plan->step = OVERRIDE_MEASURES; => plan->step = OVERRIDE_FITS;
 */
#include "plan_is_sound.h"

/* CBMC has none for 32-bit machines. */
void *memset(void *to, int value, size_t size)
{
    const struct override_ramp none = {0, 0, 0, 0, 0};
    prove(value == 0 && size == sizeof none);
    *(struct override_ramp *)to = none;
    return to;
}

/* Begun at rest: 2 d rise half, of which it may leave something, is at most the change that d was made for. */
static void begin(struct way *way, const struct override_ramp *r)
{
    prove(r->fall == 0 && r->rise <= MOST_HALF && r->even <= MOST_HALF);
    int64_t most = begun_q57 >= 0 ? begun_q57 : 2 * qmath_magnitude(r->step_q56);
    int64_t ahead = any_between(0, most);
    way->ahead = r->step_q56 < 0 ? -ahead : r->step_q56 > 0 ? ahead : 0;
}

static void at_rest(void)
{
    struct override_plan plan;
    struct program_clock clock;
    struct way way;
    any_plan(&plan, &way);
    assume(!override_ramp_moves(&plan.ramp));
    begun_q57 = -1;
    if (!comes_steady(&plan)) {
        tick_of_decision(&plan, &clock);
    }
    if (override_ramp_moves(&plan.ramp)) {
        begin(&way, &plan.ramp);
    }
    prove(is_sound(&plan, &way));
}

/* At time 0 the override begins at up to 1, else at 0. */
static void first(void)
{
    struct override_plan plan;
    struct way way = {0, 0, 0};
    assume(IS_FACTOR(plan.guaranteed.factor_q14));
    plan.guaranteed_q57 = (int64_t)plan.guaranteed.factor_q14 << 43;
    assume(plan.kind <= OVERRIDE_CLIMB && plan.window <= OVERRIDE_WINDOWS);
    begin_from_0(&plan);
    prove(is_sound(&plan, &way));
    plan.now.override_q57 = any_between(0, OVERRIDE_ONE);
    int steady = comes_steady(&plan);
    prove(steady == 0 || steady == 1);
    prove(is_sound(&plan, &way));
}

void harness(void)
{
    at_rest();
    first();
    reached();
}
