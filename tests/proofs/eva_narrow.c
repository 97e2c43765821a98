/* SPDX-License-Identifier: MIT */
/*
 * Products from halves of 16 bits, for cores that have no longer ones: no sum overflows, for any factors. Analysed by
 * Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * mutant: core/qmath.h: int32_t b0 = (int32_t)((uint32_t)b & 0xFFFFu) => int32_t b0 = (int32_t)((uint32_t)b & 0x1FFFFu)
 * mutant: core/qmath.h: int32_t other = a0 * b1 + (int32_t)((uint32_t)middle & 0xFFFFu) => int32_t other = a0 * b1 + middle
 */
#include "proof.h"

#include "core/qmath.h"

int main(void)
{
    int32_t a = (int32_t)any_between(INT32_MIN, INT32_MAX);
    int32_t b = (int32_t)any_between(INT32_MIN, INT32_MAX);
    qmath_narrow_high(a, b);
    qmath_narrow_signed(a, b);
    qmath_narrow_unsigned((uint32_t)a, (uint32_t)b);
    reached();
    return 0;
}
