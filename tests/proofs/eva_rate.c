/* SPDX-License-Identifier: MIT */
/*
 * What a tick computes of the rate's way, for any override bounds above 0, any period and any way: nothing overflows, no
 * shift is out of range, no division by 0, no product of ticks passes 64 bits; and what rate_contracts.h promises.
 *
 * prover: eva
 * assumes: qmath_div_u64 program_piece_override
 * shows: rate_bounds_of rate_pace_of rate_stage_of rate_ticks_of rate_step_of rate_span_q32
 * mutant: core/rate_pace.c: down < 32u ? => down < 64u ?
 * mutant: core/rate_pace.c: level < PROGRAM_LEVEL_FULL && => level <= PROGRAM_LEVEL_FULL &&
 * mutant: core/rate.c: (uint32_t)(way_q57 >> 27) + 1u => (uint32_t)(way_q57 >> 27)
 * mutant: core/rate.c: half > ticks->rise ? half => half > ticks->rise ? 0
 * mutant: core/rate.c: ticks->rise, ticks->half) << 1 => ticks->rise, ticks->half) << 8
 */
#include "proof.h"
#include "qmath_contracts.h"
#include "rate_contracts.h"

#include "core/rate.c"
#include "core/rate_pace.c"

/* Any pace, ticks, way and mean that the contracts allow. */
static void way(void)
{
    struct rate_pace pace = {
        (uint32_t)any_between(1, UINT32_MAX), (uint32_t)any_between(0, 0x80000001), (uint32_t)any_between(0, 0x80040000)};
    struct rate_ticks ticks;
    rate_ticks_of(&ticks, &pace, any_between(0, RATE_MOST));
    ticks.rise = (uint32_t)any_between(1, MOST_HALF);
    ticks.half = (uint32_t)any_between(1, MOST_HALF);
    prove((uint64_t)ticks.rise * ticks.half <= (uint64_t)1 << 62);
    rate_step_of(&ticks, any_between(0, RATE_MOST));
    rate_span_q32(&ticks, any_between(0, RATE_MOST), (uint32_t)any_between(1, 1 << 26));
}

/* As level_q9 of program.c; the rates of the levels. */
uint32_t program_level_q9(uint32_t level)
{
    prove(level < PROGRAM_LEVEL_FULL);
    return (uint32_t)any_between(1, 511);
}

static void period(uint32_t period_log2)
{
    struct program p;
    struct program_override bounds;
    struct rate_pace pace;
    struct rate_stage stage;
    p.header.piece_count = 5;
    //@ loop unroll 5;
    for (uint32_t first = 0; first < 5; first++) {
        rate_bounds_of(&bounds, &p, first, (uint32_t)any_between(1, UINT32_MAX));
        //@ loop unroll 7;
        for (uint32_t level = 0; level < PROGRAM_LEVELS; level++) {
            rate_pace_of(&pace, &bounds, level, period_log2);
        }
        rate_stage_of(&stage, &bounds, any_between(0, RATE_MOST), any_between(0, RATE_MOST));
        prove(stage.level < PROGRAM_LEVELS);
    }
}

int main(void)
{
    way();
    period(0);
    period(1);
    period(2);
    period(3);
    reached();
    return 0;
}
