/* SPDX-License-Identifier: MIT */
/*
 * What the numbers of core/real.h are after an operation: eva_segment.c relies on it, cbmc_real.c shows it. Included by
 * cbmc_real.c and eva_segment.c; never executed, touches nothing.
 */
#ifndef HODOGRAPH_REAL_CONTRACTS_H
#define HODOGRAPH_REAL_CONTRACTS_H

#include "core/real.h"

#define REAL_MOST_EXPONENT (1 << 20) /* of an operand */

/* clang-format off */
/*@ predicate is_real(struct real a) =
      -0x7FFFFFFF <= a.m <= 0x7FFFFFFF && -REAL_MOST_EXPONENT <= a.e <= REAL_MOST_EXPONENT;
*/
/* clang-format on */

/*@ requires -REAL_MOST_EXPONENT <= e <= REAL_MOST_EXPONENT;
    assigns \result \from m, e;
    ensures -0x7FFFFFFF <= \result.m <= 0x7FFFFFFF;
    ensures \result.e == 0 || e - 30 <= \result.e <= e + 33; */
struct real real_make(int64_t m, int32_t e);

/*@ requires is_real(a) && is_real(b);
    assigns \result \from a, b;
    ensures -0x7FFFFFFF <= \result.m <= 0x7FFFFFFF;
    ensures \result.e == 0 || a.e - 31 <= \result.e <= a.e + 1 || b.e - 31 <= \result.e <= b.e + 1; */
struct real real_add(struct real a, struct real b);

/*@ requires is_real(a) && is_real(b);
    assigns \result \from a, b;
    ensures -0x7FFFFFFF <= \result.m <= 0x7FFFFFFF;
    ensures \result.e == 0 || a.e + b.e + 30 <= \result.e <= a.e + b.e + 31; */
struct real real_mul(struct real a, struct real b);

#endif
