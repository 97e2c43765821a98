/* SPDX-License-Identifier: MIT */
/* Implements app/machine/statusword_monitor.h (see there): bits of a drive's statusword in addition to those of the
 * state, while it is in Operation enabled. Used by axis.c and machine_supervise.c. Receive and timer, under the port's
 * lock. Changes only its struct; no I/O. */
#include "app/machine/statusword_monitor.h"

#include "app/machine/fault.h"
#include "canopen/cia402.h"

/* bits that, once set, have to stay set in every mode */
#define KEEPS_ALWAYS (CIA402_STATUS_VOLTAGE | CIA402_STATUS_REMOTE)

void statusword_monitor_init(struct statusword_monitor *monitor)
{
    monitor->seen = 0;
    monitor->wrong = 0;
    monitor->in_row = 0;
}

void statusword_monitor_take(struct statusword_monitor *monitor, uint16_t statusword, bool csp)
{
    const unsigned keeps = csp ? KEEPS_ALWAYS | CIA402_STATUS_FOLLOWS : KEEPS_ALWAYS;
    const unsigned unwanted = csp ? CIA402_STATUS_FOLLOWING_ERROR : 0u;
    monitor->seen = (uint16_t)(monitor->seen | statusword);
    monitor->wrong =
        (uint16_t)((monitor->seen & keeps & ~(unsigned)statusword) | (statusword & unwanted));
    if (monitor->wrong == 0u) {
        monitor->in_row = 0;
    } else if (monitor->in_row < UINT8_MAX) {
        monitor->in_row++;
    }
}

uint16_t statusword_monitor_trouble(const struct statusword_monitor *monitor)
{
    if (monitor->in_row <= STATUSWORD_MONITOR_TOLERATED) {
        return EMCY_NO_ERROR;
    }
    if ((monitor->wrong & CIA402_STATUS_VOLTAGE) != 0u) {
        return EMCY_DC_UNDERVOLTAGE;
    }
    if ((monitor->wrong & CIA402_STATUS_REMOTE) != 0u) {
        return FAULT_NOT_REMOTE;
    }
    return (monitor->wrong & CIA402_STATUS_FOLLOWING_ERROR) != 0u ? EMCY_FOLLOWING_ERROR
                                                                  : FAULT_NOT_FOLLOWING;
}

bool statusword_monitor_follows(const struct statusword_monitor *monitor)
{
    return monitor->in_row <= STATUSWORD_MONITOR_TOLERATED ||
           (monitor->wrong & (unsigned)~CIA402_STATUS_FOLLOWING_ERROR) == 0u;
}
