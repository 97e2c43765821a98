/* SPDX-License-Identifier: MIT */
/*
 * A ramp has no more ticks of rise than of half, whatever the products of override_ticks_of are, so `even` is not
 * negative; and a step is a half of its change at most. Analysed by CBMC in `make proofs` (tools/analysis/prove.py
 * explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * replaces: qmath_product_unsigned:some_product qmath_div_u64:some_quotient
 * shows: override_ticks_of override_step_of
 * mutant: core/override_ramp.c: half > ticks->rise ? half => half > ticks->rise + 1u ? half
 * mutant: core/override_ramp.c: ? half : ticks->rise => ? half : ticks->rise - 1u
 * mutant: core/override_ramp.c: ticks->rise, ticks->half) << 1 => ticks->rise, ticks->half)
 */
#include "proof.h"
#include "ramp_contracts.h"

uint64_t some_product(uint32_t a, uint32_t b)
{
    uint64_t product = nondet_uint64();
    assume(a == 0 || b == 0 || a > MOST_HALF || b > MOST_HALF ||
           (product > 0 && product <= (uint64_t)1 << 56));
    return product;
}

uint64_t some_quotient(uint64_t a, uint64_t b)
{
    uint64_t quotient = nondet_uint64();
    prove(b != 0);
    assume(quotient <= a && (b < 2 || quotient <= a / 2));
    return quotient;
}

#include "core/qmath.c"
#include "core/override_ramp.c"

void harness(void)
{
    struct ramp_limits limits;
    struct ramp_ticks ticks;
    int64_t change_q57 = any_between(0, OVERRIDE_MOST);
    assume(IS_LIMITS(&limits));
    override_ticks_of(&ticks, &limits, change_q57);
    prove(ticks.rise <= ticks.half);
    ticks.rise = nondet_uint32();
    ticks.half = nondet_uint32();
    assume(IS_TICKS(&ticks));
    prove(override_step_of(&ticks, change_q57) <= change_q57 / 2);
    reached();
}
