/* SPDX-License-Identifier: MIT */
/* Implements core/qmath.h (see there): divisions and square roots in integers. Used by firmware/core,
 * app/machine/config and app/stream. Pure, any context. */
#include "core/qmath.h"

/* A digit of 16 bits: floor((high 2^16 + next) / b) for high < b, b with its highest bit set, and the remainder. The
 * first estimate, from the upper half of b, is at most 2 too large (Knuth, TAOCP 2, 4.3.1, theorem B). */
static uint32_t digit(uint32_t *high, uint32_t next, uint32_t b)
{
    uint32_t upper = b >> 16;
    uint32_t lower = b & 0xFFFFu;
    uint32_t q = *high / upper;
    uint32_t remainder = *high - q * upper;
    for (int i = 0; i < 2; i++) {
        if (remainder < 0x10000u && (q > 0xFFFFu || q * lower > (remainder << 16 | next))) {
            q--;
            remainder += upper;
        }
    }
    *high = (*high << 16 | next) - q * b;
    return q;
}

/* floor((high 2^32 + low) / b), high < b, b with its highest bit set. */
static uint32_t divide_normalised(uint32_t high, uint32_t low, uint32_t b)
{
    uint32_t q = digit(&high, low >> 16, b) << 16;
    return q | digit(&high, low & 0xFFFFu, b);
}

static uint64_t divide_by_word(uint64_t a, uint32_t b)
{
    int shift = qmath_clz32(b);
    uint32_t high = (uint32_t)(a >> 32);
    uint32_t q = high / b;
    uint64_t remainder = ((uint64_t)(high - q * b) << 32 | (uint32_t)a) << shift;
    return (uint64_t)q << 32 |
           divide_normalised((uint32_t)(remainder >> 32), (uint32_t)remainder, b << shift);
}

uint64_t qmath_div_u64(uint64_t a, uint64_t b)
{
    if (a < b) {
        return 0;
    }
    if (b >> 32 == 0) {
        return divide_by_word(a, (uint32_t)b);
    }
    /* By the upper 32 bits of b, a halved so that the quotient fits: at most one too large (Warren, Hacker's Delight,
     * 9-5). */
    int shift = qmath_clz64(b);
    uint64_t half = a >> 1;
    uint32_t upper = (uint32_t)(b << shift >> 32);
    uint64_t q =
        (uint64_t)divide_normalised((uint32_t)(half >> 32), (uint32_t)half, upper) << shift >> 31;
    q -= q != 0 ? 1u : 0u;
    return q + (a - q * b >= b ? 1u : 0u);
}

uint64_t qmath_div_up_u64(uint64_t a, uint64_t b)
{
    return qmath_div_u64(a + b - 1u, b);
}

uint64_t qmath_ratio(int64_t a, int64_t b, int bits)
{
    const uint64_t most = (uint64_t)1 << 60;
    const int room = qmath_clz64((uint64_t)a | 1u);
    const int up = room < bits ? room : bits;
    const uint64_t divisor = (uint64_t)b >> (bits - up);
    const uint64_t q = divisor == 0 ? most : qmath_div_u64((uint64_t)a << up, divisor);
    return q < most ? q : most;
}

int64_t qmath_shift_clamp(int64_t a, int shift)
{
    const int64_t limit = ((int64_t)1 << 62) - 1;
    if (shift <= 0) {
        a >>= shift < -63 ? 63 : -shift;
        return a > limit ? limit : a < -limit ? -limit : a;
    }
    int64_t most = shift > 62 ? 0 : limit >> shift;
    if (a > most || a < -most) {
        return a > 0 ? limit : -limit;
    }
    return a * ((int64_t)1 << (shift > 62 ? 0 : shift));
}

/* a m / 2^64 with m = word 2^32 + word: the reciprocals 2^64/3 and 2^64/5 repeat one word. */
static int64_t mul_reciprocal(int64_t a, uint32_t word)
{
    int64_t high = qmath_mul_unsigned(a, word);
    return high + (high >> 32);
}

int64_t qmath_third(int64_t a)
{
    return mul_reciprocal(a, 0x55555555u);
}

int64_t qmath_fifth(int64_t a)
{
    return mul_reciprocal(a, 0x33333333u);
}

/* Square root of a >= 2^30, by pairs of bits; *remainder gets what remains. */
static uint32_t root_of_word(uint32_t a, uint32_t *remainder)
{
    uint32_t root = 0;
    for (uint32_t bit = (uint32_t)1 << 30; bit != 0; bit >>= 2) {
        uint32_t next = root + bit;
        root >>= 1;
        if (a >= next) {
            a -= next;
            root += bit;
        }
    }
    *remainder = a;
    return root;
}

/* The upper 16 bits by pairs, the lower by a division: at most one too large (Zimmermann, "Karatsuba square root",
 * 1999). */
uint64_t qmath_root(uint64_t a)
{
    if (a == 0) {
        return 0;
    }
    int shift = qmath_clz64(a) & ~1;
    uint64_t n = a << shift;
    uint32_t remainder = 0;
    uint32_t upper = root_of_word((uint32_t)(n >> 32), &remainder);
    uint32_t lower = (remainder << 15 | (uint32_t)n >> 17) / upper;
    uint32_t root = (upper << 16) + (lower < 0xFFFFu ? lower : 0xFFFFu);
    root -= (uint64_t)root * root > n ? 1u : 0u;
    return root >> (shift / 2);
}
