/* SPDX-License-Identifier: MIT */
#include "faults/tick_count.h"

#include <string.h>

enum { SYNC = 0x080, RPDO1 = 0x200, OVERFLOW = 240, ENABLED = 0x0F };

void tick_count_init(struct tick_count *count)
{
    memset(count, 0, sizeof *count);
    count->tick = -1;
}

/* Ticks since the SYNC before. Counters run from 1 to 240. */
static uint8_t since_last(const struct tick_count *count, uint8_t counter)
{
    if (counter == 0u || count->counter == 0u) {
        return 1;
    }
    return (uint8_t)((counter + OVERFLOW - count->counter) % OVERFLOW);
}

static bool take_sync(struct tick_count *count, const struct can_msg *in)
{
    const uint8_t counter = in->len > 0 && in->data[0] <= OVERFLOW ? in->data[0] : 0;
    const uint8_t passed = since_last(count, counter);
    count->counter = counter;
    if (!count->moving || passed == 0u) {
        return false;
    }
    count->tick = count->begun ? count->tick + passed : 0;
    count->begun = true;
    return true;
}

static void take_setpoint(struct tick_count *count, const struct can_msg *in)
{
    const unsigned node = in->id - RPDO1;
    const uint32_t bits = (uint32_t)in->data[2] | (uint32_t)in->data[3] << 8 |
                          (uint32_t)in->data[4] << 16 | (uint32_t)in->data[5] << 24;
    const int32_t target = (int32_t)bits;
    const bool enabled = (in->data[0] & ENABLED) == ENABLED;
    if (enabled && count->enabled[node] && target != count->target[node]) {
        count->moving = true;
    }
    count->enabled[node] = enabled;
    count->target[node] = target;
}

bool tick_count_receive(struct tick_count *count, const struct can_msg *in)
{
    if (in->id == SYNC) {
        return take_sync(count, in);
    }
    if (!count->moving && in->id > RPDO1 && in->id < RPDO1 + TICK_COUNT_NODES && in->len >= 6) {
        take_setpoint(count, in);
    }
    return false;
}
