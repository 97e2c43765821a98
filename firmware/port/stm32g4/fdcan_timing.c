/* SPDX-License-Identifier: MIT */
#include "port/stm32g4/fdcan_timing.h"

#include "port/stm32g4/reg_fdcan.h"

#define QUANTA         24u /* of a bit: one of synchronisation, */
#define BEFORE_SAMPLE  20u
#define AFTER_SAMPLE   3u
#define JUMP           3u
#define FASTEST_BITS_S (FDCAN_TIMING_CLOCK_HZ / QUANTA)
#define PRESCALER_MAX  8u

uint32_t fdcan_timing(uint32_t bits_s)
{
    for (uint32_t prescaler = 1; prescaler <= PRESCALER_MAX; prescaler *= 2u) {
        if (bits_s * prescaler == FASTEST_BITS_S) {
            return reg_field(FDCAN_NBTP_NSJW, JUMP - 1u) |
                   reg_field(FDCAN_NBTP_NBRP, prescaler - 1u) |
                   reg_field(FDCAN_NBTP_NTSEG1, BEFORE_SAMPLE - 1u) |
                   reg_field(FDCAN_NBTP_NTSEG2, AFTER_SAMPLE - 1u);
        }
    }
    return 0;
}
