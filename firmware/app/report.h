/* SPDX-License-Identifier: MIT */
/* report: what the controller reports: emergency messages, the NMT state after its own errors, lines on the console.
 * Main loop. */
#ifndef APP_REPORT_H
#define APP_REPORT_H

#include "app/controller_state.h"

/* Reports what has changed since the last call: faults (EMCY), states, the drive that boot waits for, internal
 * limits. */
void report_changes(struct controller *controller);

#endif
