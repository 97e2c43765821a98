/* SPDX-License-Identifier: MIT */
/* statistics: counters of the tick: lateness, missed TPDOs, refused frames (object 0x2008). Used by app/machine,
 * app/tick and app/objects. Guarded by the port's lock: written by the tick and by machine_supervise.c, read by the
 * main loop. */
#ifndef APP_MACHINE_STATISTICS_H
#define APP_MACHINE_STATISTICS_H

#include <stdint.h>

struct statistics {
    uint32_t syncs; /* since power-on */
    /* Of the present or last run of a program, from start until READY or the end of a fault stop: */
    uint32_t program_tick;
    uint32_t deadline_misses; /* ticks that began more than a period after their due time */
    uint32_t worst_late_ns;
    uint32_t worst_tick_ns;
    uint32_t missed_tpdos;
    uint32_t frames_not_sent;
};

/* Sets all counters except `syncs` to 0, at the start of a program. Under the lock. */
void statistics_restart(struct statistics *statistics);

/* Counts a tick of a run: it began late_ns after its due time and took tick_ns. Timer. */
void statistics_tick(struct statistics *statistics, uint32_t late_ns, uint32_t tick_ns,
                     uint32_t period_us);

#endif
