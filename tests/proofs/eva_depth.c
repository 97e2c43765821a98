/* SPDX-License-Identifier: MIT */
/*
 * How deep a tick of a brake may go, for any jerk of the stop table and any speed that is above two ticks of it and
 * below 2^31 of them: no number wraps or overflows, no shift is out of range, no division by 0, the root is above 3/2,
 * and what comes out is at most 2^62. By octaves. Rough numbers have 31 bits. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 20000 -warn-unsigned-overflow
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/qmath.h: return high != 0 ? qmath_clz32(high) : 32 + qmath_clz32((uint32_t)a); => return zeros_of(a, high);
 * instead: core/path_brake.c: const int even = qmath_clz64(square_q32) & ~1; => const int even = even_zeros(&square_q32);
 * instead: core/path_brake.c: const uint64_t square_q32 => uint64_t square_q32
 * assumes: qmath_root_above
 * shows: depth rough_of
 * mutant: core/path_brake.c: w.exponent - j.exponent + 18 => w.exponent - j.exponent + 20
 * mutant: core/path_brake.c: (j.mantissa >> 15) + 1u => j.mantissa
 * mutant: core/path_brake.c: THREE_HALVES_Q16 98304u => THREE_HALVES_Q16 196608u
 * mutant: core/path_brake.c: (uint64_t)a << zeros >> 33), 33 - zeros => (uint64_t)a << zeros >> 34), 34 - zeros
 * mutant: core/path_brake.c: (uint64_t)9 << 30 => (uint64_t)1 << 30
 */
#include "proof.h"

#include <stdint.h>

/* The same numbers, in as many states as there are. */
static int zeros_of(uint64_t a, uint32_t high)
{
    int n = 0;
    (void)high;
    //@ loop unroll 64;
    for (; n < 63 && a < (uint64_t)1 << (63 - n); n++) {
    }
    return n;
}

static int even_zeros(uint64_t *a)
{
    int n = 0;
    //@ loop unroll 32;
    for (; n < 62 && *a < (uint64_t)1 << (62 - n); n += 2) {
    }
    return n;
}

#include "core/qmath.h"

/* cbmc_root.c */
/*@ requires a >= 0x40000000;
    assigns \result \from a;
    ensures 0x8000 <= \result <= 65602; */
static inline uint32_t qmath_root_above(uint32_t a);

#include "core/path_brake.c"

/* w in [from, to), j in [low, high) */
static void part(int64_t from, int64_t to, int64_t low, int64_t high)
{
    const int64_t jerk = any_between(low, high - 1);
    const int64_t w = any_between(from, to - 1);
    const int64_t b = depth(w, jerk);
    prove(b > 0 && b <= POWER(62));
}

/* All but 0 have 31 bits. */
static void mantissas(void)
{
    struct rough r = rough_of(0);
    prove(r.mantissa == 0 && r.exponent == -30);
    //@ loop unroll 63;
    for (int bits = 0; bits < 63; bits++) {
        r = rough_of(any_between(POWER(bits), POWER(bits) + (POWER(bits) - 1)));
        prove(r.mantissa >= POWER(30) && r.mantissa < POWER(31) && r.exponent == bits - 30);
    }
}

int main(void)
{
    mantissas();
    for (int jerk = 22; jerk < 60; jerk++) {
        for (int w = jerk + 1; w < 61 && w < jerk + 31; w++) {
            part(POWER(w), POWER(w + 1), POWER(jerk), POWER(jerk + 1));
        }
    }
    reached();
    return 0;
}
