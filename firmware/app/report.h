/* SPDX-License-Identifier: MIT */
/* report: what the controller tells of itself: emergency messages, the NMT state after its own errors, lines for a human. Mainline. */
#ifndef APP_REPORT_H
#define APP_REPORT_H

#include "app/controller.h"

/* Tells of faults (EMCY), states, drives that keep the others waiting and limits that have changed since the last call. */
void report_changes(struct controller *controller);

#endif
