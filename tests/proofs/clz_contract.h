/* SPDX-License-Identifier: MIT */
/* Contract of qmath_clz64 that proofs assume: it is a built-in function of the compiler. A header of its own, for
 * proofs that include the other functions of core/qmath. Included by proofs of this folder. Declarations only; never
 * executed, touches nothing. */
#ifndef HODOGRAPH_CLZ_CONTRACT_H
#define HODOGRAPH_CLZ_CONTRACT_H

#include <stdint.h>

/*@ requires a != 0;
    assigns \result \from a;
    ensures 0 <= \result <= 63 && (a < 0x8000000000000000 ==> \result >= 1); */
static inline int qmath_clz64(uint64_t a);

#endif
