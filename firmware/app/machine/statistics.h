/* SPDX-License-Identifier: MIT */
/* statistics: how the ticks went (object 0x2008). Guarded by the port's lock. */
#ifndef APP_MACHINE_STATISTICS_H
#define APP_MACHINE_STATISTICS_H

#include <stdint.h>

struct statistics {
    uint32_t syncs; /* since power-on */
    /* of the present or last run of a program: from start until READY (or the end of braking) */
    uint32_t program_tick;
    uint32_t deadline_misses; /* ticks that began more than a period after their due time */
    uint32_t worst_late_ns;
    uint32_t worst_tick_ns;
    uint32_t missed_tpdos;
    uint32_t frames_not_sent;
};

/* A program starts: everything but the SYNCs begins again at 0. Under the lock. */
void statistics_restart(struct statistics *statistics);

/* A tick of a run that began late_ns after its due time took tick_ns. Timer. */
void statistics_tick(struct statistics *statistics, uint32_t late_ns, uint32_t tick_ns,
                     uint32_t period_us);

#endif
