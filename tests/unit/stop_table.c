/* SPDX-License-Identifier: MIT */
/* Implements stop_table.h (see there): the stop table of an image that a test has made, with the bounds that the
 * check requires. Part of the C tests; no I/O. */
#include "stop_table.h"

#include <string.h>

#include "core/stop_check.h"
#include "golden.h"
#include "unity.h"

static void put_u32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++) {
        at[i] = (uint8_t)(value >> (8 * i));
    }
}

static struct stop_bound write_bounds(const struct program *p, uint8_t *image, uint8_t *table,
                                      enum program_stop_kind kind)
{
    struct stop_walk walk;
    struct stop_bound worst = {0, 0};
    stop_walk_begin(&walk, p, kind);
    for (uint32_t i = p->header.piece_count; i > 0; i--) {
        const struct stop_bound bound = stop_walk_back(&walk, i - 1u);
        put_u32(table + (i - 1u) * PROGRAM_STOP_SIZE + 8u + 4u * (uint32_t)kind, bound.time_us);
        worst.time_us = bound.time_us > worst.time_us ? bound.time_us : worst.time_us;
        worst.distance_um =
            bound.distance_um > worst.distance_um ? bound.distance_um : worst.distance_um;
    }
    put_u32(image + 112u + 8u * (uint32_t)kind, worst.time_us);
    put_u32(image + 116u + 8u * (uint32_t)kind, worst.distance_um);
    return worst;
}

void stop_table_fill(struct program *p, uint8_t *image, const uint8_t codes[6])
{
    const uint32_t count = p->header.piece_count;
    uint8_t *table = image + p->header.header_size +
                     (size_t)p->header.segment_count * program_segment_size(p->header.axis_count) +
                     (size_t)count * PROGRAM_PIECE_SIZE;
    for (uint32_t i = 0; i < count; i++) {
        memcpy(table + (size_t)i * PROGRAM_STOP_SIZE, codes, 6);
    }
    const struct stop_bound hold = write_bounds(p, image, table, PROGRAM_STOP_HOLD);
    const struct stop_bound fault = write_bounds(p, image, table, PROGRAM_STOP_FAULT);
    p->header.hold_worst_us = hold.time_us;
    p->header.hold_worst_um = hold.distance_um;
    p->header.fault_worst_us = fault.time_us;
    p->header.fault_worst_um = fault.distance_um;
}

void stop_table_write(uint8_t *image, uint32_t size, const uint8_t codes[6])
{
    struct program p;
    golden_seal(image, size);
    TEST_ASSERT_EQUAL_INT(0, program_open(&p, image, size));
    stop_table_fill(&p, image, codes);
    golden_seal(image, size);
}
