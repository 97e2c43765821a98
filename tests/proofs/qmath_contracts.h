/* SPDX-License-Identifier: MIT */
/*
 * What other proofs take for granted of qmath. Which proof or test shows each: docs/theory/proofs.md section 15.5.
 * Included by proofs of this folder; never executed, touches nothing.
 */
#ifndef HODOGRAPH_QMATH_CONTRACTS_H
#define HODOGRAPH_QMATH_CONTRACTS_H

#include <stdint.h>

#include "clz_contract.h"
#include "thirds_contract.h"

/*@ assigns \result \from a, shift;
    ensures -(1 << 62) < \result < (1 << 62); */
int64_t qmath_shift_clamp(int64_t a, int shift);

/*@ requires b != 0;
    assigns \result \from a, b;
    ensures \result == a / b; */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

/*@ assigns \result \from a;
    ensures \result < 0x100000000 && (a >= 0x10000000 ==> \result >= 0x3FFF); */
uint64_t qmath_root(uint64_t a);

#endif
