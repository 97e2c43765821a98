/* SPDX-License-Identifier: MIT */
/* What proofs take for granted of qmath_clz64, which is the compiler's own; alone, for proofs that have the other
 * functions of qmath. Included by proofs of this folder; never executed. */
#ifndef HODOGRAPH_CLZ_CONTRACT_H
#define HODOGRAPH_CLZ_CONTRACT_H

#include <stdint.h>

/*@ requires a != 0;
    assigns \result \from a;
    ensures 0 <= \result <= 63 && (a < 0x8000000000000000 ==> \result >= 1); */
static inline int qmath_clz64(uint64_t a);

#endif
