/* SPDX-License-Identifier: MIT */
/* Implements app/machine/statistics.h (see there): how the ticks went (object 0x2008). Used by app/machine, app/tick
 * and app/objects. Guarded by the port's lock: written by the tick and by machine_supervise.c, read by the main loop.
 */
#include "app/machine/statistics.h"

void statistics_restart(struct statistics *statistics)
{
    *statistics = (struct statistics){.syncs = statistics->syncs};
}

void statistics_tick(struct statistics *statistics, uint32_t late_ns, uint32_t tick_ns,
                     uint32_t period_us)
{
    if (late_ns > period_us * 1000u) {
        statistics->deadline_misses++;
    }
    if (late_ns > statistics->worst_late_ns) {
        statistics->worst_late_ns = late_ns;
    }
    if (tick_ns > statistics->worst_tick_ns) {
        statistics->worst_tick_ns = tick_ns;
    }
}
