/* SPDX-License-Identifier: MIT */
/*
 * What a tick computes of a ramp of the override, for any override bounds above 0, any period and any change: nothing
 * overflows, no shift is out of range, no division by 0, no product of ticks passes 64 bits; and what
 * override_contracts.h promises. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords);
 * never executed, touches nothing.
 *
 * prover: eva
 * assumes: qmath_div_u64 program_piece_override
 * shows: override_bounds_of override_limits_of override_change_of override_stage_of override_ticks_of override_step_of override_span_q32
 * mutant: core/override_ramp.c: down < 32u ? => down < 64u ?
 * mutant: core/override_ramp.c: k < PROGRAM_LEVEL_FULL => k <= PROGRAM_LEVEL_FULL
 * mutant: core/override_ramp.c: (uint32_t)(change_q57 >> 27) + 1u => (uint32_t)(change_q57 >> 27)
 * mutant: core/override_ramp.c: half > ticks->rise ? half => half > ticks->rise ? 0
 * mutant: core/override_ramp.c: ticks->rise, ticks->half) << 1 => ticks->rise, ticks->half) << 8
 */
#include "proof.h"
#include "qmath_contracts.h"
#include "ramp_contracts.h"

#include "core/override_ramp.c"

/* Any limits, ticks, change and mean that the contracts allow. */
static void ramp(void)
{
    struct ramp_limits limits = {
        (uint32_t)any_between(1, UINT32_MAX), (uint32_t)any_between(0, 0x80000001), (uint32_t)any_between(0, 0x80040000)};
    struct ramp_ticks ticks;
    override_ticks_of(&ticks, &limits, any_between(0, OVERRIDE_MOST));
    ticks.rise = (uint32_t)any_between(1, MOST_HALF);
    ticks.half = (uint32_t)any_between(1, MOST_HALF);
    prove((uint64_t)ticks.rise * ticks.half <= (uint64_t)1 << 62);
    override_step_of(&ticks, any_between(0, OVERRIDE_MOST));
    override_span_q32(&ticks, any_between(0, OVERRIDE_MOST), (uint32_t)any_between(1, 1 << 26));
}

static void period(uint32_t period_log2)
{
    struct program p;
    struct program_override bounds;
    struct ramp_limits limits;
    struct ramp_change change;
    struct ramp_stage stage;
    p.header.piece_count = 5;
    //@ loop unroll 5;
    for (uint32_t first = 0; first < 5; first++) {
        override_bounds_of(&bounds, &p, first, (uint32_t)any_between(1, UINT32_MAX));
        //@ loop unroll 7;
        for (uint32_t level = 0; level < PROGRAM_LEVELS; level++) {
            override_limits_of(&limits, &bounds, level, period_log2);
        }
        override_change_of(&change, any_between(0, OVERRIDE_MOST), any_between(0, OVERRIDE_MOST));
        prove(change.first < PROGRAM_LEVELS && change.last < PROGRAM_LEVELS);
        override_stage_of(&stage, &bounds, &change);
        prove(stage.level < PROGRAM_LEVELS);
    }
}

int main(void)
{
    ramp();
    period(0);
    period(1);
    period(2);
    period(3);
    reached();
    return 0;
}
