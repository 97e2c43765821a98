/* SPDX-License-Identifier: MIT */
/* Implements node/sync_clock.h (see there): the time base of a simulated drive. Called by node/drive_node and
 * node/drive_od. All in one context. Changes only its struct; no I/O. */
#include "node/sync_clock.h"

void sync_clock_reset_counter(struct sync_clock *clock, uint8_t overflow)
{
    sync_consumer_init(&clock->sync, overflow);
}

void sync_clock_await(struct sync_clock *clock)
{
    clock->without_us = 0;
    clock->lost = false;
}

int sync_clock_receive(struct sync_clock *clock, const struct can_msg *in, uint8_t overflow)
{
    if (clock->lost) {
        clock->lost = false;
        sync_clock_reset_counter(clock, overflow);
    }
    const int periods = sync_consumer_receive(&clock->sync, in);
    clock->seen = clock->seen || periods >= 0;
    return periods;
}

bool sync_clock_process(struct sync_clock *clock, uint32_t elapsed_us, uint32_t timeout_us,
                        bool stopped)
{
    clock->without_us = clock->seen || clock->lost ? 0 : clock->without_us + elapsed_us;
    clock->seen = false;
    if (clock->lost || (!stopped && clock->without_us <= timeout_us)) {
        return false;
    }
    clock->lost = true;
    clock->own_us = 0;
    return true;
}

uint32_t sync_clock_own_periods(struct sync_clock *clock, uint32_t elapsed_us, uint32_t period_us)
{
    const uint32_t us = clock->own_us + elapsed_us;
    clock->own_us = us % period_us;
    return us / period_us;
}
