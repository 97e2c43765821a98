/* SPDX-License-Identifier: MIT */
/* Contracts of qmath_third and qmath_fifth that proofs assume; docs/theory/proofs.md section 15.2 gives the argument. A
 * header of its own, because eva_brake.c and eva_fixed.c include core/qmath.c and can assume these two only. Included
 * by these proofs and by qmath_contracts.h. Declarations only; never executed, touches nothing. */
#ifndef HODOGRAPH_THIRDS_CONTRACT_H
#define HODOGRAPH_THIRDS_CONTRACT_H

#include <stdint.h>

/*@ requires -(1 << 62) < a < (1 << 62);
    assigns \result \from a;
    ensures a / 3 - 3 <= \result <= a / 3; */
int64_t qmath_third(int64_t a);

/*@ requires -(1 << 62) < a < (1 << 62);
    assigns \result \from a;
    ensures a / 5 - 3 <= \result <= a / 5; */
int64_t qmath_fifth(int64_t a);

#endif
