/* SPDX-License-Identifier: MIT */
/* report: reports changes of the controller: emergency messages, the NMT state after its own errors, lines on the
 * console. Used by app/controller.c. Main loop; takes the port's lock to read the machine. Sends emergency messages,
 * changes the NMT state and what it has reported, and prints by port_log. */
#ifndef APP_REPORT_H
#define APP_REPORT_H

#include "app/controller_state.h"

/* Reports what has changed since the last call: faults (EMCY), states, the drive that boot waits for, internal
 * limits. */
void report_changes(struct controller *controller);

#endif
