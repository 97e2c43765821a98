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
