/* SPDX-License-Identifier: MIT */
/* Implements core/qwide.h (see there): exact sums of products of 50-bit numbers, for decisions that must not depend on
 * rounding. Used by core/segment_check and core/joint_check. Pure, any context. */
#include "core/qwide.h"

#define LOW_BITS  50
#define LOW_MASK  (((int64_t)1 << LOW_BITS) - 1)
#define LIMB_MASK 0x1FFFFFF

static struct qwide normal(int64_t high, int64_t low)
{
    struct qwide n = {high + (low >> LOW_BITS), low & LOW_MASK};
    return n;
}

struct qwide qwide_add_product(struct qwide sum, int64_t a, int64_t b, int64_t weight)
{
    int64_t a1 = a >> 25;
    int64_t b1 = b >> 25;
    int64_t a0 = a & LIMB_MASK;
    int64_t b0 = b & LIMB_MASK;
    int64_t middle = a1 * b0 + a0 * b1;
    int64_t high = a1 * b1 + (middle >> 25);
    int64_t low = (middle & LIMB_MASK) * (LIMB_MASK + 1) + a0 * b0;
    return normal(sum.high + weight * high, sum.low + weight * low);
}

struct qwide qwide_add(struct qwide a, struct qwide b)
{
    return normal(a.high + b.high, a.low + b.low);
}

struct qwide qwide_abs(struct qwide a)
{
    return a.high < 0 ? normal(-a.high, -a.low) : a;
}

struct qwide qwide_shift_down(struct qwide a, int bits)
{
    int64_t out = a.high & (((int64_t)1 << bits) - 1);
    struct qwide shifted = {a.high >> bits, (a.low >> bits) + (out << (LOW_BITS - bits))};
    return shifted;
}

int qwide_compare(struct qwide a, struct qwide b)
{
    if (a.high != b.high) {
        return a.high < b.high ? -1 : 1;
    }
    return a.low < b.low ? -1 : a.low > b.low ? 1 : 0;
}
