/* SPDX-License-Identifier: MIT */
/*
 * Square roots (core/qmath.h): no division by 0, no shift out of range, no unsigned overflow, and `__builtin_clz` is
 * never called with 0. For any word of at least 2^30 the root is in [2^15, 2^16), the remainder is at most twice the
 * root, and qmath_root_above is in [2^15, 65602]. For any 64-bit number qmath_root is below 2^32; for numbers of 2^28
 * or more it is at least 2^14 - 1.
 *
 * Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 70 --unsigned-overflow-check
 * shows: qmath_root qmath_root_above
 * mutant: core/qmath.c: qmath_clz64(a) & ~1 => 0
 * mutant: core/qmath.c: bit = (uint32_t)1 << 30 => bit = (uint32_t)1 << 31
 * mutant: core/qmath.c: bit >>= 2 => bit >>= 3
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
    uint32_t word = nondet_uint32();
    uint32_t rest = 0;
    __CPROVER_assume(word >= 1u << 30);
    uint32_t root = root_of_word(word, &rest);
    prove(root >= 1u << 15 && root < 1u << 16 && rest <= 2u * root);
    uint32_t above = qmath_root_above(word);
    prove(above >= 1u << 15 && above <= 65602u);
    uint64_t a = nondet_uint64();
    uint64_t of_a = qmath_root(a);
    prove(of_a < (uint64_t)1 << 32);
    prove(a < (uint64_t)1 << 28 || of_a >= 0x3FFF);
    reached();
}
