/* SPDX-License-Identifier: MIT */
#include "core/qmath.h"

uint64_t qmath_div_u64(uint64_t a, uint32_t b)
{
    uint64_t rest = 0;
    uint64_t quotient = 0;
    for (int bit = 63; bit >= 0; bit--) {
        rest = rest << 1 | ((a >> bit) & 1u);
        quotient <<= 1;
        if (rest >= b) {
            rest -= b;
            quotient |= 1u;
        }
    }
    return quotient;
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

uint64_t qmath_root(uint64_t a)
{
    uint64_t root = 0;
    for (uint64_t bit = (uint64_t)1 << 62; bit != 0; bit >>= 2) {
        uint64_t next = root + bit;
        root >>= 1;
        if (a >= next) {
            a -= next;
            root += bit;
        }
    }
    return root;
}
