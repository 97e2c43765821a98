/* SPDX-License-Identifier: MIT */
/*
 * tpdo_monitor: which SYNCs a drive has answered with its TPDO1, and which it has left unanswered.
 *
 * A TPDO1 does not say which SYNC it answers. One that is absent at the next SYNC is only late when two of them come
 * during a later SYNC, at most `wait_us` after the SYNC it belongs to; else it is missed. Only missed ones are counted,
 * late ones are not; of a drive that is lost all are. (A drive that is late by one SYNC from some time on appears as
 * one missed answer.)
 *
 * Guarded by the port's lock; times are port_time_us(), which wraps.
 */
#ifndef APP_MACHINE_TPDO_MONITOR_H
#define APP_MACHINE_TPDO_MONITOR_H

#include <stdbool.h>
#include <stdint.h>

/* When more are absent at once the oldest counts as missed. */
#define TPDO_MONITOR_UNSETTLED 8u

struct tpdo_monitor {
    bool present;           /* has answered a SYNC since tpdo_monitor_init */
    bool lost;              /* more than the permitted number missed in a row */
    uint8_t count;          /* to the present SYNC; more than 1: late ones, or frames doubled */
    uint32_t last_us;       /* time of the last one */
    uint32_t absent_in_row; /* SYNCs in a row without one */
    uint32_t absent_us
        [TPDO_MONITOR_UNSETTLED]; /* a ring: SYNCs not answered, and not known yet whether late or missed */
    uint8_t first;                /* the oldest of these */
    uint8_t unsettled;            /* how many */
    uint32_t missed;              /* all in all */
};

void tpdo_monitor_init(struct tpdo_monitor *answers);

/* A TPDO1 has come. Receive. */
void tpdo_monitor_take(struct tpdo_monitor *answers, uint32_t now_us);

/* Counts anew from here on; a drive that is present stays so. Under the lock. */
void tpdo_monitor_restart(struct tpdo_monitor *answers);

/* The usual end of a SYNC: true when it was answered and none is unsettled; then nothing is missed. False, with nothing
 * changed: tpdo_monitor_close_sync has to be called. Timer. */
static inline bool tpdo_monitor_close_answered(struct tpdo_monitor *answers)
{
    if (answers->count == 0u || answers->unsettled != 0u) {
        return false;
    }
    answers->count = 0;
    answers->absent_in_row = 0;
    return true;
}

/* The SYNC that was sent at sync_us is over. Up to missed_max SYNCs in a row may pass without an answer; one more, and
 * more than wait_us since the last answer, and the drive is lost, until it answers again. Returns how many answers are
 * now known to be missed. Timer. */
uint32_t tpdo_monitor_close_sync(struct tpdo_monitor *answers, uint32_t now_us, uint32_t sync_us,
                                 uint32_t wait_us, uint8_t missed_max);

#endif
