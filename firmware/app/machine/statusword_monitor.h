/* SPDX-License-Identifier: MIT */
/*
 * statusword_monitor: finds wrong bits in the statusword of a drive in Operation enabled, other than the bits of its
 * state. Used by axis.c and machine_supervise.c. Receive and timer, under the port's lock. Changes only its struct; no
 * I/O.
 *
 * Bits that have been set since the drive was enabled must stay: voltage (4), remote (9) and, in CSP, "follows the
 * command value" (12). Following error (13, in CSP) must stay clear. A bit is reported when it is wrong in more than
 * STATUSWORD_MONITOR_TOLERATED answers in a row. The internal limit (11) is a warning and not checked here.
 */
#ifndef APP_MACHINE_STATUSWORD_MONITOR_H
#define APP_MACHINE_STATUSWORD_MONITOR_H

#include <stdbool.h>
#include <stdint.h>

#define STATUSWORD_MONITOR_TOLERATED 2u

struct statusword_monitor {
    uint16_t seen;  /* bits that have been set */
    uint16_t wrong; /* bits wrong in the last answer */
    uint8_t in_row; /* answers with wrong bits */
};

void statusword_monitor_init(struct statusword_monitor *monitor);

/* A statusword in Operation enabled; csp: bits 12 and 13 have their meaning of that mode. Receive. */
void statusword_monitor_take(struct statusword_monitor *monitor, uint16_t statusword, bool csp);

/* What is wrong, as an error code of app/machine/fault.h or canopen/emcy.h; 0: nothing. Pure. */
uint16_t statusword_monitor_trouble(const struct statusword_monitor *monitor);

/* Whether the drive, by these bits, follows its controlword and its target. A following error alone does not count.
 * Pure. */
bool statusword_monitor_follows(const struct statusword_monitor *monitor);

#endif
