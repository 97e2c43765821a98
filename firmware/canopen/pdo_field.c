/* SPDX-License-Identifier: MIT */
#include "canopen/pdo_field.h"

#include <string.h>

#include "canopen/cob.h"

/* 2 and 4 bytes without a loop, since this is each tick's work. */
void pdo_field_store(const struct pdo_field *field, const uint8_t *from)
{
    uint16_t u16;
    uint32_t u32;
    uint64_t u64;

    switch (field->size) {
    case 1:
        *field->value = *from;
        break;
    case 2:
        u16 = (uint16_t)(from[0] | (from[1] << 8));
        memcpy(field->value, &u16, sizeof u16);
        break;
    case 4:
        u32 = from[0] | ((uint32_t)from[1] << 8) | ((uint32_t)from[2] << 16) |
              ((uint32_t)from[3] << 24);
        memcpy(field->value, &u32, sizeof u32);
        break;
    default:
        u64 = cob_get(from, field->size);
        memcpy(field->value, &u64, sizeof u64);
        break;
    }
}

void pdo_field_load(const struct pdo_field *field, uint8_t *to)
{
    uint16_t u16;
    uint32_t u32;
    uint64_t u64;

    switch (field->size) {
    case 1:
        *to = *field->value;
        break;
    case 2:
        memcpy(&u16, field->value, sizeof u16);
        to[0] = (uint8_t)(u16 & 0xFFu);
        to[1] = (uint8_t)(u16 >> 8);
        break;
    case 4:
        memcpy(&u32, field->value, sizeof u32);
        to[0] = (uint8_t)(u32 & 0xFFu);
        to[1] = (uint8_t)((u32 >> 8) & 0xFFu);
        to[2] = (uint8_t)((u32 >> 16) & 0xFFu);
        to[3] = (uint8_t)(u32 >> 24);
        break;
    default:
        memcpy(&u64, field->value, sizeof u64);
        cob_put(to, u64, field->size);
        break;
    }
}
