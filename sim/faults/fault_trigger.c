/* SPDX-License-Identifier: MIT */
/* Implements faults/fault_trigger.h (see there): when a fault rule acts. Used by sim/injector/forwarder and
 * sim/node/node_faults. Changes its struct only; one thread. */
#include "faults/fault_trigger.h"

#include <string.h>

/* COB-IDs; end of the SYNC counter; bits of a controlword that mean enable operation. */
enum { SYNC = 0x080, RPDO1 = 0x200, OVERFLOW = 240, ENABLED = 0x0F };

void fault_ticks_init(struct fault_ticks *ticks)
{
    memset(ticks, 0, sizeof *ticks);
    ticks->tick = -1;
}

/* Ticks since the SYNC before. Counters run from 1 to 240. */
static uint8_t since_last(const struct fault_ticks *ticks, uint8_t counter)
{
    if (counter == 0u || ticks->counter == 0u) {
        return 1;
    }
    return (uint8_t)((counter + OVERFLOW - ticks->counter) % OVERFLOW);
}

static bool take_sync(struct fault_ticks *ticks, const struct can_msg *in)
{
    const uint8_t counter = in->len > 0 && in->data[0] <= OVERFLOW ? in->data[0] : 0;
    const uint8_t passed = since_last(ticks, counter);
    ticks->counter = counter;
    if (!ticks->moving || passed == 0u) {
        return false;
    }
    ticks->tick = ticks->begun ? ticks->tick + passed : 0;
    ticks->begun = true;
    return true;
}

static void take_setpoint(struct fault_ticks *ticks, const struct can_msg *in)
{
    const unsigned node = in->id - RPDO1;
    const uint32_t bits = (uint32_t)in->data[2] | (uint32_t)in->data[3] << 8 |
                          (uint32_t)in->data[4] << 16 | (uint32_t)in->data[5] << 24;
    const int32_t target = (int32_t)bits;
    const bool enabled = (in->data[0] & ENABLED) == ENABLED;
    if (enabled && ticks->enabled[node] && target != ticks->target[node]) {
        ticks->moving = true;
    }
    ticks->enabled[node] = enabled;
    ticks->target[node] = target;
}

bool fault_ticks_receive(struct fault_ticks *ticks, const struct can_msg *in)
{
    if (in->id == SYNC) {
        return take_sync(ticks, in);
    }
    if (!ticks->moving && in->id > RPDO1 && in->id < RPDO1 + FAULT_TICKS_NODES && in->len >= 6) {
        take_setpoint(ticks, in);
    }
    return false;
}

void fault_trigger_init(struct fault_trigger *trigger, const struct fault_rule *rule)
{
    *trigger = (struct fault_trigger){.rule = rule, .random = rule->seed};
}

bool fault_trigger_acts(struct fault_trigger *trigger, int64_t tick, uint64_t now_ns)
{
    const struct fault_rule *rule = trigger->rule;
    if (tick < (int64_t)rule->at || (rule->count != 0u && trigger->used >= rule->count)) {
        return false;
    }
    if (rule->for_ms == 0u) {
        return tick < (int64_t)rule->at + rule->for_ticks;
    }
    trigger->began_ns = trigger->began_ns == 0u ? now_ns : trigger->began_ns;
    return now_ns - trigger->began_ns < 1000000ull * rule->for_ms;
}

uint64_t fault_trigger_end_ns(const struct fault_trigger *trigger)
{
    const uint32_t lasts_ms = trigger->rule->for_ms;
    return lasts_ms == 0u || trigger->began_ns == 0u ? UINT64_MAX
                                                     : trigger->began_ns + 1000000ull * lasts_ms;
}

/* SplitMix64 (Steele, Lea, Flood 2014): any seed is a good one. In [0, 1). */
static double draw(uint64_t *state)
{
    uint64_t z = (*state += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-53;
}

bool fault_trigger_takes(struct fault_trigger *trigger, const struct can_msg *frame)
{
    if (frame->id != trigger->rule->id || draw(&trigger->random) >= trigger->rule->p) {
        return false;
    }
    trigger->used++;
    return true;
}
