/* SPDX-License-Identifier: MIT */
/* What proofs take for granted of the divisions of qmath by 3 and 5 (docs/theory/proofs.md section 15.2); alone,
 * likewise. Included by eva_brake.c, eva_fixed.c and qmath_contracts.h; never executed. */
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
