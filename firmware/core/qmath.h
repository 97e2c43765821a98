/* SPDX-License-Identifier: MIT */
/*
 * Integer arithmetic shared by the core: shifts, counts of zeros, wide products, slow division.
 *
 * Right shifts of negative numbers: C99 leaves them to the implementation. gcc, clang and every compiler we build
 * with shift arithmetically (floor); qmath_assert_arithmetic_shift stops the build where that is not so. It is the only
 * implementation-defined behaviour the core relies on, besides conversion to a signed type modulo 2^N.
 */
#ifndef HODOGRAPH_CORE_QMATH_H
#define HODOGRAPH_CORE_QMATH_H

#include <stdint.h>

typedef char qmath_assert_arithmetic_shift[(-3 >> 1) == -2 ? 1 : -1];

/* Leading zeros of a non-zero value. */
static inline int qmath_clz32(uint32_t a)
{
#if defined(__GNUC__)
    return __builtin_clz(a);
#else
    int n = 0;
    while ((a & 0x80000000u) == 0) {
        a <<= 1;
        n++;
    }
    return n;
#endif
}

static inline int qmath_clz64(uint64_t a)
{
    uint32_t high = (uint32_t)(a >> 32);
    return high != 0 ? qmath_clz32(high) : 32 + qmath_clz32((uint32_t)a);
}

/* floor(a / b), b not 0: shift and subtract, for targets without a 64-bit division. 64 rounds: not in the tick. */
uint64_t qmath_div_u64(uint64_t a, uint32_t b);

#endif
