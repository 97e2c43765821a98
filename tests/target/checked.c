/* SPDX-License-Identifier: MIT */
/* Implements checked.h (see there): opens the program in the store, and has the limits that it is checked against. Part
 * of the images checker and stop_checker. Reads the store. */
#include "checked.h"

#include <stdint.h>

#define TRAVEL_Q40_MM ((int64_t)200 << 40)

extern const uint8_t startup_store_base[];

static uint32_t image_size(void)
{
    const uint8_t *at = startup_store_base + 8; /* docs/reference/protocol.md 1.1 */
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

int checked_open(struct program *program)
{
    return program_open(program, startup_store_base, image_size());
}

/* The limits of examples/machines/paper_alpha.toml. */
struct program_limits checked_limits(void)
{
    const struct program_limits limits = {
        .period_us = 1000,
        .feed_um_s = 500000,
        .acceleration_um_s2 = 5000000,
        .jerk_mm_s3 = 200000,
        .min_q40_mm = {-TRAVEL_Q40_MM, -TRAVEL_Q40_MM},
        .max_q40_mm = {TRAVEL_Q40_MM, TRAVEL_Q40_MM},
        .axis_velocity_um_s = {500000, 500000},
        .axis_acceleration_um_s2 = {5000000, 5000000},
        .axis_jerk_mm_s3 = {200000, 200000},
    };
    return limits;
}
