/* SPDX-License-Identifier: MIT */
/*
 * crc32: the CRC-32 of IEEE 802.3, for images, chunks and banks: polynomial 0xEDB88320 reflected, initial value and
 * final XOR 0xFFFFFFFF (the CRC of zlib, so `zlib.crc32` in Python gives the same). Source: docs/reference/protocol.md
 * 1.1. Used by firmware/app, core/chunk and core/program. Pure functions, any context.
 */
#ifndef HODOGRAPH_CORE_CRC32_H
#define HODOGRAPH_CORE_CRC32_H

#include <stdint.h>

/* CRC of `size` bytes. For several blocks pass the result of the previous block; the first block has crc = 0.
 * Sixteen-entry table: about 10 instructions for each byte. */
uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size);

#endif
