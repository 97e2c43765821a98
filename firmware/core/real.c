/* SPDX-License-Identifier: MIT */
/* Implements core/real.h (see there): floating-point numbers in integers, the same on every target. Used by
 * firmware/core: the checks of joints, and the proofs of axis limits and stops. Pure, any context. */
#include "core/real.h"

#include "core/qmath.h"

#define MANTISSA_BITS 31

struct real real_make(int64_t m, int32_t e)
{
    struct real out = {0, 0};
    if (m == 0) {
        return out;
    }
    const uint64_t size = m < 0 ? 0u - (uint64_t)m : (uint64_t)m;
    const int bits = 64 - qmath_clz64(size);
    const uint32_t kept = bits > MANTISSA_BITS ? (uint32_t)(size >> (bits - MANTISSA_BITS))
                                               : (uint32_t)size << (MANTISSA_BITS - bits);
    out.m = m < 0 ? -(int32_t)kept : (int32_t)kept;
    out.e = e + bits - MANTISSA_BITS;
    return out;
}

/* m 2^e with |m| < 2^32. */
static struct real from_sum(int64_t m, int32_t e)
{
    struct real out = {0, 0};
    const uint32_t size = (uint32_t)(m < 0 ? -m : m);
    if (size == 0u) {
        return out;
    }
    const int above = qmath_clz32(size);
    const int32_t kept = (int32_t)(above == 0 ? size >> 1 : size << (above - 1));
    out.m = m < 0 ? -kept : kept;
    out.e = e + 1 - above;
    return out;
}

struct real real_add(struct real a, struct real b)
{
    const struct real high = a.e >= b.e ? a : b;
    const struct real low = a.e >= b.e ? b : a;
    const int32_t apart = high.e - low.e;
    if (a.m == 0 || b.m == 0) {
        return a.m == 0 ? b : a;
    }
    return apart >= MANTISSA_BITS ? high : from_sum((int64_t)high.m + (low.m >> apart), high.e);
}

/* The product of two normal numbers has 61 or 62 bits. */
struct real real_mul(struct real a, struct real b)
{
    const int64_t product = (int64_t)a.m * b.m;
    const uint64_t size = (uint64_t)(product < 0 ? -product : product);
    const int32_t drop = MANTISSA_BITS - 1 + (int32_t)(size >> 61);
    const int32_t kept = (int32_t)(size >> drop);
    const struct real out = {product < 0 ? -kept : kept, a.e + b.e + drop};
    const struct real zero = {0, 0};
    return size == 0u ? zero : out;
}

struct real real_div(struct real a, struct real b)
{
    const uint64_t above = (uint64_t)(a.m < 0 ? -(int64_t)a.m : a.m) << MANTISSA_BITS;
    const uint32_t below = (uint32_t)(b.m < 0 ? -b.m : b.m);
    const int64_t quotient = (int64_t)qmath_div_u64(above, below);
    return real_make((a.m < 0) != (b.m < 0) ? -quotient : quotient, a.e - b.e - MANTISSA_BITS);
}
