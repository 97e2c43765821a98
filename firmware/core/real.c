/* SPDX-License-Identifier: MIT */
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

struct real real_add(struct real a, struct real b)
{
    if (a.m == 0) {
        return b;
    }
    if (b.m == 0) {
        return a;
    }
    const struct real high = a.e >= b.e ? a : b;
    const struct real low = a.e >= b.e ? b : a;
    const int32_t apart = high.e - low.e;
    if (apart > MANTISSA_BITS) {
        return high;
    }
    const int64_t unit = (int64_t)1 << MANTISSA_BITS;
    return real_make(high.m * unit + ((low.m * unit) >> apart), high.e - MANTISSA_BITS);
}

struct real real_mul(struct real a, struct real b)
{
    return real_make((int64_t)a.m * b.m, a.e + b.e);
}

struct real real_div(struct real a, struct real b)
{
    const uint64_t above = (uint64_t)(a.m < 0 ? -(int64_t)a.m : a.m) << MANTISSA_BITS;
    const uint32_t below = (uint32_t)(b.m < 0 ? -b.m : b.m);
    const int64_t quotient = (int64_t)qmath_div_u64(above, below);
    return real_make((a.m < 0) != (b.m < 0) ? -quotient : quotient, a.e - b.e - MANTISSA_BITS);
}
