/* SPDX-License-Identifier: MIT */
#include "canopen/crc16.h"

#define CRC16_POLYNOMIAL 0x1021u

static uint16_t crc16_byte(uint16_t crc, uint8_t byte)
{
    uint32_t shifted = (uint32_t)crc ^ ((uint32_t)byte << 8);

    for (int bit = 0; bit < 8; bit++) {
        shifted <<= 1;
        if ((shifted & 0x10000u) != 0) {
            shifted ^= 0x10000u | CRC16_POLYNOMIAL;
        }
    }
    return (uint16_t)shifted;
}

uint16_t crc16_update(uint16_t crc, const uint8_t *data, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        crc = crc16_byte(crc, data[i]);
    }
    return crc;
}
