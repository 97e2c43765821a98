/* SPDX-License-Identifier: MIT */
/* crc16: the CRC of SDO block transfers (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1,
 * initial value 0, not reflected.
 *
 * Check value of "123456789": 0x31C3. Pure, any context.
 */
#ifndef CANOPEN_CRC16_H
#define CANOPEN_CRC16_H

#include <stdint.h>

/* Goes on from `crc` (0 at the beginning) over `size` bytes. */
uint16_t crc16_update(uint16_t crc, const uint8_t *data, uint32_t size);

#endif
