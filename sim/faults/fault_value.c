/* SPDX-License-Identifier: MIT */
#include "faults/fault_value.h"

#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static bool is_hex(const char *digits)
{
    return digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X');
}

bool fault_value_read(const char *text, enum fault_field field, double *out)
{
    char *end = NULL;
    const bool negative = text[0] == '-';
    const char *digits = negative ? text + 1 : text;
    const bool hex = is_hex(digits);
    if (!(digits[0] >= '0' && digits[0] <= '9') && digits[0] != '.') {
        return false;
    }
    errno = 0;
    if (field == FAULT_FIELD_NUMBER && !hex) {
        *out = strtod(digits, &end);
    } else {
        *out = (double)strtoull(digits, &end, hex ? 16 : 10);
    }
    *out = negative ? -*out : *out;
    return end != digits && *end == '\0' && errno == 0;
}

void fault_value_store(unsigned char *field, enum fault_field type, double number)
{
    const int64_t whole = type == FAULT_FIELD_NUMBER ? 0 : (int64_t)number;
    const uint8_t u8 = (uint8_t)whole;
    const uint16_t u16 = (uint16_t)whole;
    const uint32_t u32 = (uint32_t)whole;
    const int32_t i32 = (int32_t)whole;
    switch (type) {
    case FAULT_FIELD_U8:
        memcpy(field, &u8, sizeof u8);
        break;
    case FAULT_FIELD_U16:
        memcpy(field, &u16, sizeof u16);
        break;
    case FAULT_FIELD_U32:
        memcpy(field, &u32, sizeof u32);
        break;
    case FAULT_FIELD_I32:
        memcpy(field, &i32, sizeof i32);
        break;
    default:
        memcpy(field, &number, sizeof number);
        break;
    }
}
