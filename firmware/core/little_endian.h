/* SPDX-License-Identifier: MIT */
/* little_endian: reads little-endian integers at any alignment, as images and chunks have them. Used by core/program
 * and core/chunk. Pure, any context. */
#ifndef HODOGRAPH_CORE_LITTLE_ENDIAN_H
#define HODOGRAPH_CORE_LITTLE_ENDIAN_H

#include <stdint.h>

static inline uint32_t read_u16(const uint8_t *b)
{
    return (uint32_t)b[0] | (uint32_t)b[1] << 8;
}

static inline uint32_t read_u32(const uint8_t *b)
{
    return read_u16(b) | read_u16(b + 2) << 16;
}

static inline uint32_t read_u24(const uint8_t *b)
{
    return read_u16(b) | (uint32_t)b[2] << 16;
}

static inline uint64_t read_u64(const uint8_t *b)
{
    return (uint64_t)read_u32(b) | (uint64_t)read_u32(b + 4) << 32;
}

static inline int64_t read_i64(const uint8_t *b)
{
    return (int64_t)read_u64(b);
}

static inline int64_t read_i48(const uint8_t *b)
{
    return (int64_t)((uint64_t)read_u32(b) << 16 | (uint64_t)read_u16(b + 4) << 48) >> 16;
}

static inline int64_t read_i56(const uint8_t *b)
{
    return (int64_t)((uint64_t)read_u32(b) << 8 | (uint64_t)read_u24(b + 4) << 40) >> 8;
}

#endif
