/* SPDX-License-Identifier: MIT */
#include "faults/fault_watch.h"

void fault_watch_init(struct fault_watch *watch, const struct fault_rule *rule)
{
    *watch = (struct fault_watch){.rule = rule, .random = rule->seed};
}

bool fault_watch_acts(struct fault_watch *watch, int64_t tick, uint64_t now_ns)
{
    const struct fault_rule *rule = watch->rule;
    if (tick < (int64_t)rule->at || (rule->count != 0u && watch->used >= rule->count)) {
        return false;
    }
    if (rule->for_ms == 0u) {
        return tick < (int64_t)rule->at + rule->for_ticks;
    }
    watch->began_ns = watch->began_ns == 0u ? now_ns : watch->began_ns;
    return now_ns - watch->began_ns < 1000000ull * rule->for_ms;
}

uint64_t fault_watch_end_ns(const struct fault_watch *watch)
{
    const uint32_t lasts_ms = watch->rule->for_ms;
    return lasts_ms == 0u || watch->began_ns == 0u ? UINT64_MAX
                                                   : watch->began_ns + 1000000ull * lasts_ms;
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

bool fault_watch_takes(struct fault_watch *watch, const struct can_msg *frame)
{
    if (frame->id != watch->rule->id || draw(&watch->random) >= watch->rule->p) {
        return false;
    }
    watch->used++;
    return true;
}
