/* SPDX-License-Identifier: MIT */
/*
 * qmath, qwide and counts: no operation overflows, no shift is out of range, under the conditions that their headers
 * state; and the ranges of the results that other proofs rely on. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * assumes: qmath_clz64
 * shows: qmath_shift_clamp
 * mutant: core/qmath.h: a1 * b1 * 4096 => a1 * b1 * 16384
 * mutant: core/qmath.h: return a < 0 ? -a : a => return -a
 * mutant: core/qwide.c: (middle & LIMB_MASK) * (LIMB_MASK + 1) => middle * (LIMB_MASK + 1)
 */
#include "clz_contract.h"
#include "proof.h"

#include "core/counts.h"
#include "core/qmath.c"
#include "core/qwide.c"

static int64_t any(void)
{
    return any_between(INT64_MIN, INT64_MAX);
}

static int32_t any32(void)
{
    return (int32_t)any_between(INT32_MIN, INT32_MAX);
}

static void products(void)
{
    int64_t a = any_between(1 - POWER(50), POWER(50) - 1);
    int64_t b = any_between(1 - POWER(50), POWER(50) - 1);
    int64_t ab = qmath_mul_q44(a, b);
    prove(ab <= POWER(62) + POWER(39) && ab >= -POWER(62) - POWER(39));
    qmath_mul_hi(any32(), any32());
    qmath_mul_wide(any(), any32());
    qmath_mul_unsigned(any(), (uint32_t)any32());
    counts_from_q40_mm(any(), (uint32_t)any32());
}

static void shifts(void)
{
    int64_t kept;
    int shift = (int)any_between(-63, 63);
    //@ split shift;
    qmath_shift(any(), shift);
    //@ merge shift;
    shift = any32();
    if (shift > 0 && shift < 64) {
        //@ split shift;
        kept = qmath_shift_clamp(any(), shift);
        prove(kept < POWER(62) && kept > -POWER(62));
        //@ merge shift;
    } else {
        kept = qmath_shift_clamp(any(), shift);
        prove(kept < POWER(62) && kept > -POWER(62));
    }
    int bits = (int)any_between(1, 62);
    //@ split bits;
    qmath_round(any_between(1 - POWER(62), POWER(62) - 1), bits);
    //@ merge bits;
}

static void quotients(void)
{
    int64_t a = any_between(1 - POWER(62), POWER(62) - 1);
    qmath_third(a);
    qmath_fifth(a);
    qmath_clamp32(any());
    prove(qmath_magnitude(a) >= 0);
    prove(qmath_lesser(a, 0) <= 0 && qmath_greater(a, 0) >= 0);
}

static struct qwide any_wide(int64_t most)
{
    struct qwide a = {any_between(-most, most), any_between(0, POWER(50) - 1)};
    return a;
}

static void wide(void)
{
    struct qwide sum = any_wide(POWER(61));
    int64_t a = any_between(1 - POWER(50), POWER(50) - 1);
    int64_t b = any_between(1 - POWER(50), POWER(50) - 1);
    sum = qwide_add_product(sum, a, b, any_between(-16, 16));
    prove(sum.low >= 0 && sum.low < POWER(50));
    prove(sum.high >= -POWER(61) - POWER(55) && sum.high <= POWER(61) + POWER(55));
    sum = qwide_abs(qwide_add(any_wide(POWER(61)), any_wide(POWER(61))));
    prove(sum.low >= 0 && sum.low < POWER(50) && sum.high >= 0);
    int bits = (int)any_between(0, 49);
    //@ split bits;
    qwide_shift_down(any_wide(POWER(62)), bits);
    //@ merge bits;
    qwide_compare(any_wide(POWER(62)), any_wide(POWER(62)));
}

int main(void)
{
    products();
    shifts();
    quotients();
    wide();
    reached();
    return 0;
}
