/* SPDX-License-Identifier: MIT */
/* Implements canopen/cob.h (see there): identifiers of the predefined connection set and little-endian access to frame
 * bytes. Used by firmware/app, firmware/canopen and sim/node. Any context; the functions write only their arguments. */
#include "canopen/cob.h"

#include <string.h>

void cob_frame(struct can_msg *out, uint32_t id, uint8_t len)
{
    out->id = id;
    out->len = len;
    memset(out->data, 0, sizeof out->data);
}

uint64_t cob_get(const uint8_t *from, uint32_t size)
{
    uint64_t value = 0;

    for (uint32_t i = size; i > 0; i--) {
        value = (value << 8) | from[i - 1];
    }
    return value;
}

void cob_put(uint8_t *to, uint64_t value, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        to[i] = (uint8_t)(value & 0xFFu);
        value >>= 8;
    }
}

int64_t cob_signed(uint64_t value, uint32_t size)
{
    uint64_t sign = UINT64_C(1) << (8 * size - 1);
    uint64_t low = value & (sign - 1);

    if ((value & sign) == 0) {
        return (int64_t)low;
    }
    /* low - sign, without an intermediate result outside int64_t */
    return -(int64_t)(sign - 1 - low) - 1;
}
