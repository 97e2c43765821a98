/* SPDX-License-Identifier: MIT */
/* Implements app/machine/tpdo_monitor.h: counts the TPDO1 frames that a drive did not send. Used by app/machine.
 * Receive, timer and main loop, under the port's lock. Changes only the monitor that it is given. No I/O. */
#include "app/machine/tpdo_monitor.h"

#include <string.h>

void tpdo_monitor_init(struct tpdo_monitor *monitor)
{
    memset(monitor, 0, sizeof *monitor);
}

void tpdo_monitor_take(struct tpdo_monitor *monitor, uint32_t now_us)
{
    if (monitor->count < UINT8_MAX) {
        monitor->count++;
    }
    monitor->present = true;
    monitor->lost = false;
    monitor->last_us = now_us;
}

void tpdo_monitor_restart(struct tpdo_monitor *monitor)
{
    const struct tpdo_monitor before = *monitor;
    tpdo_monitor_init(monitor);
    monitor->present = before.present;
    monitor->last_us = before.last_us;
}

/* The oldest pending frame has come late, or counts as missed. */
static void drop_oldest_pending(struct tpdo_monitor *monitor)
{
    monitor->first = (uint8_t)((monitor->first + 1u) % TPDO_MONITOR_PENDING_MAX);
    monitor->pending--;
}

static uint32_t note_absent(struct tpdo_monitor *monitor, uint32_t sync_us)
{
    uint32_t missed = 0;
    if (monitor->pending == TPDO_MONITOR_PENDING_MAX) {
        drop_oldest_pending(monitor);
        missed = 1;
    }
    monitor->absent_us[(monitor->first + monitor->pending) % TPDO_MONITOR_PENDING_MAX] = sync_us;
    monitor->pending++;
    if (monitor->absent_in_row < UINT32_MAX) {
        monitor->absent_in_row++;
    }
    return missed;
}

static void note_present(struct tpdo_monitor *monitor)
{
    for (uint32_t late = monitor->count - 1u; late > 0u && monitor->pending > 0u; --late) {
        drop_oldest_pending(monitor);
    }
    monitor->absent_in_row = 0;
}

uint32_t tpdo_monitor_close_sync(struct tpdo_monitor *monitor, uint32_t now_us, uint32_t sync_us,
                                 uint32_t wait_us, uint8_t missed_max)
{
    uint32_t missed = 0;
    if (!monitor->present) {
        return 0;
    }
    if (monitor->count == 0u) {
        missed = note_absent(monitor, sync_us);
    } else {
        note_present(monitor);
    }
    monitor->count = 0;
    /* a lost drive stays lost: its time since the last TPDO1 wraps to 0 every 71 min */
    monitor->lost = monitor->absent_in_row > missed_max &&
                    (monitor->lost || now_us - monitor->last_us > wait_us);
    while (monitor->pending > 0u &&
           (monitor->lost || now_us - monitor->absent_us[monitor->first] >= wait_us)) {
        drop_oldest_pending(monitor);
        missed++;
    }
    monitor->missed += missed;
    return missed;
}
