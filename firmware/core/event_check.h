/* SPDX-License-Identifier: MIT */
/* event_check: checks the events of a program, which switch outputs on the path (docs/reference/protocol.md 1.8). A
 * part of program_check. Pure, main loop. */
#ifndef HODOGRAPH_CORE_EVENT_CHECK_H
#define HODOGRAPH_CORE_EVENT_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* All events of a program whose segments and pieces have passed their own checks. Linear: pieces and events advance
 * together. Returns 0 or PROGRAM_ERR_EVENT_... with the index of the event. */
int event_check_all(const struct program *p, uint32_t *index);

#endif
