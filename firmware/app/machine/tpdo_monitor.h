/* SPDX-License-Identifier: MIT */
/*
 * tpdo_monitor: counts the TPDO1 frames that a drive did not send, one monitor for each axis.
 *
 * The drive sends one TPDO1 after each SYNC. The frame does not contain which SYNC it answers. So a TPDO1 that is
 * absent at the next SYNC is pending first. If two TPDO1 arrive in a later period, at most `wait_us` after the SYNC of
 * the pending one, the pending TPDO1 was late. Otherwise it is missed. Missed frames are counted, late ones are not.
 * All pending frames of a lost drive are missed. If every TPDO1 of a drive arrives one period late from some SYNC on,
 * one frame is counted as missed.
 *
 * Used by app/machine; objects_axis.c reads `missed` and `present`. Receive, timer and main loop, under the port's
 * lock. Changes only the monitor that it is given. No I/O. Times are port_time_us(), which wraps.
 */
#ifndef APP_MACHINE_TPDO_MONITOR_H
#define APP_MACHINE_TPDO_MONITOR_H

#include <stdbool.h>
#include <stdint.h>

/* Frames that can be pending. One more, and the oldest counts as missed. */
#define TPDO_MONITOR_PENDING_MAX 8u

struct tpdo_monitor {
    bool present;           /* a TPDO1 has come since tpdo_monitor_init, or since axis_init */
    bool lost;              /* the drive has not answered more SYNCs in a row than is permitted */
    uint8_t count;          /* TPDO1 since the present SYNC; more than 1: late or doubled frames */
    uint32_t last_us;       /* time of the last TPDO1 */
    uint32_t absent_in_row; /* SYNCs in a row without a TPDO1 */
    /* ring: times of the SYNCs whose TPDO1 is pending */
    uint32_t absent_us[TPDO_MONITOR_PENDING_MAX];
    uint8_t first;   /* index of the oldest */
    uint8_t pending; /* number of pending frames */
    uint32_t missed; /* frames missed since tpdo_monitor_init, tpdo_monitor_restart or axis_init */
};

void tpdo_monitor_init(struct tpdo_monitor *monitor);

/* A TPDO1 has come at now_us. Receive. */
void tpdo_monitor_take(struct tpdo_monitor *monitor, uint32_t now_us);

/* Sets all counters to 0 and `lost` to false. `present` and `last_us` stay. Main loop or timer, under the lock. */
void tpdo_monitor_restart(struct tpdo_monitor *monitor);

/* Quick path of tpdo_monitor_close_sync. If the SYNC was answered and no frame is pending, closes it and returns true;
 * no frame is missed. Otherwise changes nothing and returns false: the caller then calls tpdo_monitor_close_sync.
 * Timer. */
static inline bool tpdo_monitor_close_answered(struct tpdo_monitor *monitor)
{
    if (monitor->count == 0u || monitor->pending != 0u) {
        return false;
    }
    monitor->count = 0;
    monitor->absent_in_row = 0;
    return true;
}

/* Closes the SYNC that was sent at sync_us. The drive is lost when more than missed_max SYNCs in a row have no answer
 * and the last answer is more than wait_us ago; it stays lost until its next TPDO1. Returns the number of frames that
 * this call found to be missed. Timer. */
uint32_t tpdo_monitor_close_sync(struct tpdo_monitor *monitor, uint32_t now_us, uint32_t sync_us,
                                 uint32_t wait_us, uint8_t missed_max);

#endif
