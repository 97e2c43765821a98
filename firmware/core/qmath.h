/* SPDX-License-Identifier: MIT */
/*
 * qmath: integer arithmetic shared by the core: counts of zeros, wide products, slow division. Used by firmware/core,
 * app/machine/config and app/stream.
 *
 * Right shifts of negative numbers: C99 leaves them to the implementation. gcc, clang and every compiler we build with
 * shift arithmetically (floor); the typedef below stops the build where that is not so. The core relies on one more
 * implementation-defined rule: conversion to a narrower signed type is modulo 2^N. Nothing else.
 *
 * All functions are pure: any context. The inline ones take constant time.
 *
 * Names of fixed-point numbers, in all of the core:
 *
 *   NAME_qN_UNIT     an integer that stands for integer / 2^N of the unit: x_q40_mm in 2^-40 mm, time_q42_s in 2^-42 s
 *   NAME_qN          the same without a unit: override_q57, 2^57 = 1
 *   NAME_UNIT        whole units: period_us, feed_um_s
 *   unit of speed    mm_s; of acceleration mm_s2; of jerk mm_s3
 *   q56 of a path stop and of an override ramp: mm, or 1, a tick, a tick squared or cubed, as their headers say
 *
 * A conversion to fewer bits after the point drops bits (floor) unless it is qmath_round; one to more is exact.
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

/* Cores with a multiplication of 32 x 32 bits to 32 only (ARMv6-M): four of 16 x 16 instead of a call. */
#if defined(__ARM_ARCH_6M__) || defined(__ARM_ARCH_8M_BASE__)
#define QMATH_NARROW 1
#else
#define QMATH_NARROW 0
#endif

/* a b from halves of 16 bits. Knuth, TAOCP 2, 4.3.1, algorithm M: no sum passes 2^32. */
static inline uint64_t qmath_narrow_unsigned(uint32_t a, uint32_t b)
{
    uint32_t a0 = a & 0xFFFFu;
    uint32_t a1 = a >> 16;
    uint32_t b0 = b & 0xFFFFu;
    uint32_t b1 = b >> 16;
    uint32_t middle = a1 * b0 + ((a0 * b0) >> 16);
    uint32_t other = a0 * b1 + (middle & 0xFFFFu);
    uint32_t high = a1 * b1 + (middle >> 16) + (other >> 16);
    return (uint64_t)high << 32 | a * b;
}

/* The upper word of a b; the upper halves have the signs. */
static inline int32_t qmath_narrow_high(int32_t a, int32_t b)
{
    int32_t a0 = (int32_t)((uint32_t)a & 0xFFFFu);
    int32_t a1 = a >> 16;
    int32_t b0 = (int32_t)((uint32_t)b & 0xFFFFu);
    int32_t b1 = b >> 16;
    int32_t middle = a1 * b0 + (int32_t)(((uint32_t)a0 * (uint32_t)b0) >> 16);
    int32_t other = a0 * b1 + (int32_t)((uint32_t)middle & 0xFFFFu);
    return a1 * b1 + (middle >> 16) + (other >> 16);
}

static inline int64_t qmath_narrow_signed(int32_t a, int32_t b)
{
    uint32_t high = (uint32_t)qmath_narrow_high(a, b);
    return (int64_t)((uint64_t)high << 32 | (uint32_t)a * (uint32_t)b);
}

/* The same number, hidden from the optimiser: otherwise gcc extends a factor that is used often to 64 bits beforehand
 * and multiplies with four instructions instead of one. */
static inline int32_t qmath_plain(int32_t a)
{
#if defined(__GNUC__) && defined(__arm__)
    __asm__("" : "+r"(a));
#endif
    return a;
}

/* a b, exact. */
static inline int64_t qmath_product(int32_t a, int32_t b)
{
    return QMATH_NARROW ? qmath_narrow_signed(a, b) : (int64_t)qmath_plain(a) * qmath_plain(b);
}

static inline uint64_t qmath_product_unsigned(uint32_t a, uint32_t b)
{
    return QMATH_NARROW ? qmath_narrow_unsigned(a, b) : (uint64_t)a * b;
}

/* floor(a b / 2^32) of 32-bit numbers: one SMULL, or SMMUL where there is one. */
static inline int32_t qmath_mul_hi(int32_t a, int32_t b)
{
    return QMATH_NARROW ? qmath_narrow_high(a, b)
                        : (int32_t)(((int64_t)qmath_plain(a) * qmath_plain(b)) >> 32);
}

/* a b / 2^32 of a 64-bit and a 32-bit number, within 1.5 units. Two SMULL: the lowest bit of a is
 * dropped so that its lower half is a signed 32-bit number. Any a and b. */
static inline int64_t qmath_mul_wide(int64_t a, int32_t b)
{
    int32_t high = (int32_t)(a >> 32);
    int32_t low = (int32_t)((uint32_t)a >> 1);
    return qmath_product(high, b) + (qmath_product(low, b) >> 31);
}

/* floor(a b / 2^32) of a signed 64-bit and an unsigned 32-bit number. Any a and b. */
static inline int64_t qmath_mul_unsigned(int64_t a, uint32_t b)
{
    uint32_t high = (uint32_t)((uint64_t)a >> 32);
    uint64_t product =
        qmath_product_unsigned(high, b) + (qmath_product_unsigned((uint32_t)a, b) >> 32);
    return (int64_t)(product - ((uint64_t)(a < 0 ? b : 0u) << 32));
}

/* floor(a b / 2^38), exact, for |a|, |b| < 2^50: q44 times q44 is q50. Limbs of 25 bits keep every
 * partial sum inside 63 bits, so no carry is ever needed. */
static inline int64_t qmath_mul_q44(int64_t a, int64_t b)
{
    int32_t a1 = (int32_t)(a >> 25);
    int32_t b1 = (int32_t)(b >> 25);
    int32_t a0 = (int32_t)(a & 0x1FFFFFF);
    int32_t b0 = (int32_t)(b & 0x1FFFFFF);
    int64_t middle = (int64_t)a1 * b0 + (int64_t)a0 * b1 + (((int64_t)a0 * b0) >> 25);
    return (int64_t)a1 * b1 * 4096 + (middle >> 13);
}

/* a 2^shift, floor for negative shifts; -63 <= shift <= 63, and the result must fit. */
static inline int64_t qmath_shift(int64_t a, int shift)
{
    return shift >= 0 ? (int64_t)((uint64_t)a << (shift & 63)) : a >> (-shift & 63);
}

/* a 2^shift, floor for negative shifts, kept within +-(2^62 - 1); any shift. */
int64_t qmath_shift_clamp(int64_t a, int shift);

/* a / 2^bits to nearest, halves up; 1 <= bits <= 62 and |a| < 2^62. */
static inline int64_t qmath_round(int64_t a, int bits)
{
    return (a + ((int64_t)1 << (bits - 1))) >> bits;
}

/* Program times: 2^-32 s in the image and the object dictionary, 2^-42 s in a tick; below 2^22 s. */
static inline uint64_t qmath_q42_of_q32(uint64_t time_q32_s)
{
    return time_q32_s << 10;
}

/* Rounded down. */
static inline uint64_t qmath_q32_of_q42(uint64_t time_q42_s)
{
    return time_q42_s >> 10;
}

/* |a|; not of INT64_MIN. */
static inline int64_t qmath_magnitude(int64_t a)
{
    return a < 0 ? -a : a;
}

static inline int64_t qmath_lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static inline int64_t qmath_greater(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

/* The nearest value of i32. */
static inline int32_t qmath_clamp32(int64_t a)
{
    int32_t low = (int32_t)a;
    return low == a ? low : (int32_t)((uint32_t)(a >> 63) ^ (uint32_t)INT32_MAX);
}

/* floor(a / b), b not 0. By at most three 32-bit divisions: the time of the compiler library's 64-bit division
 * depends on its operands, so an image must not have it (tools/check_image). */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

/* The same, rounded up; a + b below 2^64. */
uint64_t qmath_div_up_u64(uint64_t a, uint64_t b);

/* a / b with so many bits (0 ... 32) after the point, held at 2^60; a >= 0, b > 0. Right to a unit, and to 2^-20 of it
 * where b is at least 2^-10 of a and has 52 bits. */
uint64_t qmath_ratio(int64_t a, int64_t b, int bits);

/* floor of the square root: 16 rounds of additions, and one 32-bit division. */
uint64_t qmath_root(uint64_t a);

/* At least the square root of a, 2^30 <= a, and at most 2^-10 of it and 2 more: a straight line, off by 5 %, and one
 * step of Heron's rule, whose error is half the square of that and always above. */
static inline uint32_t qmath_root_above(uint32_t a)
{
    uint32_t line = ((a >> 16) * 43u >> 6) + 23200u;
    return ((line + a / line + 1u) >> 1) + 1u;
}

/* a / 3 and a / 5 for |a| < 2^62, by the reciprocal: at most 2 units below the exact value. */
int64_t qmath_third(int64_t a);
int64_t qmath_fifth(int64_t a);

#endif
