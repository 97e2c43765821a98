/* SPDX-License-Identifier: MIT */
/*
 * The check of a program, to count what it costs: the store holds an image, which is opened and checked against the
 * limits of the machines in examples/machines. Exit status 0: accepted.
 */
#include <stdint.h>

#include "core/program_check.h"
#include "port/semihost/semihost.h"

enum { STATUS_REFUSED = 1, STATUS_FILE = 5 };

extern const uint8_t startup_store_base[];

static uint32_t image_size(void)
{
    const uint8_t *at = startup_store_base + 8; /* docs/reference/protocol.md 1.1 */
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

int main(void)
{
    const int64_t travel_q40_mm = (int64_t)200 << 40;
    const struct program_limits limits = {
        .period_us = 1000,
        .feed_um_s = 500000,
        .acceleration_um_s2 = 5000000,
        .jerk_mm_s3 = 200000,
        .min_q40_mm = {-travel_q40_mm, -travel_q40_mm},
        .max_q40_mm = {travel_q40_mm, travel_q40_mm},
        .axis_velocity_um_s = {500000, 500000},
        .axis_acceleration_um_s2 = {5000000, 5000000},
        .axis_jerk_mm_s3 = {200000, 200000},
    };
    struct program program;
    struct program_fault fault;
    if (program_open(&program, startup_store_base, image_size()) != 0) {
        return STATUS_FILE;
    }
    return program_check(&program, &limits, &fault) == 0 ? 0 : STATUS_REFUSED;
}
