/* SPDX-License-Identifier: MIT */
/*
 * What a tick computes of the rate's way, for any override bounds above 0, any period and any way: nothing overflows, no
 * shift is out of range, no division by 0, and a way takes a tick at least.
 *
 * prover: eva
 * assumes: qmath_div_u64 qmath_root program_piece_override
 * mutant: core/rate_pace.c: return (uint32_t)qmath_div_u64(a, b) + 1u => return (uint32_t)qmath_div_u64(a, b)
 * mutant: core/rate_pace.c: scaled(bounds->second_q8_per_s2, squared << 8 => scaled(bounds->second_q8_per_s2, 0
 * mutant: core/rate.c: (uint32_t)(way_q57 >> 27) + 1u => (uint32_t)(way_q57 >> 27)
 * mutant: core/rate.c: half > ticks->rise ? half => half > ticks->rise ? 0
 * mutant: core/rate.c: 2 * (slope_q56 + next) => 256 * (slope_q56 + next)
 */
#include "core/rate.h"
#include "core/rate_pace.h"
#include "proof.h"

/* Its value: test_qmath.c. */
/*@ requires b != 0;
    assigns \result \from a, b;
    ensures \result == a / b; */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

/* cbmc_root.c; 2^28 has the root 2^14. */
/*@ assigns \result \from a;
    ensures \result < 0x100000000 && (a >= 0xFFFFFFF ==> \result >= 0x3FFF); */
uint64_t qmath_root(uint64_t a);

/*@ requires i < p->header.piece_count;
    assigns *factor_q24, *rate_q16_per_s, *second_q8_per_s2 \from i;
    ensures \initialized(factor_q24) && \initialized(rate_q16_per_s) && \initialized(second_q8_per_s2);
    ensures 0x1000000 <= *factor_q24 <= 0x2000000 && *rate_q16_per_s > 0 && *second_q8_per_s2 > 0; */
void program_piece_override(const struct program *p, uint32_t i, uint32_t *factor_q24,
                            uint32_t *rate_q16_per_s, uint32_t *second_q8_per_s2);

#include "core/rate.c"
#include "core/rate_pace.c"

static void way(const struct rate_pace *pace)
{
    struct rate_ticks ticks;
    int64_t way_q57 = any_between(0, RATE_MOST);
    rate_ticks_of(&ticks, pace, way_q57);
    prove(ticks.rise >= 1 && ticks.half >= 1);
    rate_step_of(&ticks, way_q57);
    rate_span_q32(&ticks, any_between(0, RATE_MOST), (uint32_t)any_between(1, 1 << 26));
}

/* The slope is what has risen, at most half of the greatest way; section 12. */
static void move(void)
{
    struct rate_move m;
    Frama_C_make_unknown((char *)&m, sizeof m);
    m.step_q56 = any_between(-RATE_ONE, RATE_ONE);
    m.rest_q57 = any_between(-POWER(60), POWER(60));
    struct rate now = {any_between(0, RATE_MOST), any_between(-RATE_ONE, RATE_ONE)};
    rate_tick(&now, rate_move_slope(&m, now.slope_q56));
    rate_move_shorten(&m);
    rate_move_cut(&m);
}

static void period(uint32_t period_us)
{
    struct program p;
    struct rate_bounds bounds;
    struct rate_pace pace;
    p.header.piece_count = 5;
    rate_bounds_of(&bounds, &p, 2, (uint32_t)any_between(1, 16));
    rate_pace_make(&pace, &bounds, period_us);
    way(&pace);
}

int main(void)
{
    move();
    period(1000);
    period(2000);
    period(4000);
    period(8000);
    reached();
    return 0;
}
