/* SPDX-License-Identifier: MIT */
/*
 * The slow division and the count of zeros: no division by 0, no zero counted, no shift out of range, for any operands
 * but a divisor of 0. Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never
 * executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 70
 * shows: qmath_clz64 qmath_div_u64 qmath_div_up_u64
 * mutant: core/qmath.c: int shift = qmath_clz32(b); => int shift = 0;
 * mutant: core/qmath.h: return high != 0 ? => return high == 0 ?
 */
#include "proof.h"

int __builtin_clz(unsigned a)
{
    __CPROVER_assert(a != 0, "no zero is counted");
    int n = (int)any_between(0, 31);
    __CPROVER_assume(a >> (31 - n) == 1u);
    return n;
}

#include "core/qmath.c"

void harness(void)
{
    uint64_t b = nondet_uint64();
    __CPROVER_assume(b != 0);
    qmath_div_u64(nondet_uint64(), b);
    qmath_div_up_u64(nondet_uint64(), b);
    int zeros = qmath_clz64(b);
    prove(zeros >= 0 && zeros <= 63 && b >> (63 - zeros) == 1u);
    reached();
}
