/* SPDX-License-Identifier: MIT */
/* Implements port/common/decimal.h (see there): an integer as text. Used by the ports. Pure. */
#include "port/common/decimal.h"

/* Digits from the end. */
const char *decimal(int32_t value, char text[DECIMAL_SIZE])
{
    uint32_t rest = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
    uint32_t at = DECIMAL_SIZE - 1u;
    text[at] = '\0';
    do {
        text[--at] = (char)('0' + rest % 10u);
        rest /= 10u;
    } while (rest != 0u);
    if (value < 0) {
        text[--at] = '-';
    }
    return &text[at];
}
