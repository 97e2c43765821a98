/* SPDX-License-Identifier: MIT */
/*
 * What a proof is written with; the same words for both provers. tools/analysis/prove.py runs the proofs, and
 * docs/theory/proofs.md section 15 says what they show. Included by proofs of this folder; never executed, touches
 * nothing.
 */
#ifndef HODOGRAPH_PROOF_H
#define HODOGRAPH_PROOF_H

#include <stdint.h>

#if defined(__FRAMAC__)

#include "__fc_builtin.h"

/* Any value of [low, high]. */
#define any_between(low, high) Frama_C_long_long_interval(low, high)

/*@ requires holds != 0;
    assigns \nothing; */
void prove(int holds);

/* Marks the end of a proof: it counts only when the prover comes here. */
#define reached() Frama_C_show_each_reached()

#else

int64_t nondet_int64(void);
uint32_t nondet_uint32(void);
uint64_t nondet_uint64(void);

static inline int64_t any_between(int64_t low, int64_t high)
{
    int64_t a = nondet_int64();
    __CPROVER_assume(a >= low && a <= high);
    return a;
}

#define assume(holds) __CPROVER_assume(holds)
#define prove(holds)  __CPROVER_assert(holds, #holds)
#define reached()     __CPROVER_assert(0, "reached")

#endif

/* 2^bits */
#define POWER(bits) ((int64_t)1 << (bits))

#endif
