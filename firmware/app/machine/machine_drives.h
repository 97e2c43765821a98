/* SPDX-License-Identifier: MIT */
/* machine_drives: all drives of a machine at once: sets their goals, and evaluates their states. Used by app/machine
 * only. Under the lock, any context. Changes only the goals of the axes; no I/O. */
#ifndef APP_MACHINE_MACHINE_DRIVES_H
#define APP_MACHINE_MACHINE_DRIVES_H

#include "app/machine/machine.h"

/* The same goal for all axes. */
void machine_command(struct machine *machine, enum cia402_goal goal);

/* Whether every drive answers, is enabled and follows its target, and frames reach them. */
bool machine_followed(const struct machine *machine);

/* Whether a drive that answers has power on and still moves. */
bool machine_any_moves(const struct machine *machine);

/* The first drive that still moves by its own power, or NULL. */
const struct axis *machine_not_stopped(const struct machine *machine);

/* The first axis that is further from its target than the start tolerance, or NULL. */
const struct axis *machine_not_arrived(const struct machine *machine);

/* The first drive that answers but has not reached its goal, or NULL. */
const struct axis *machine_late_drive(const struct machine *machine);

/* The drive's own emergency code if it has sent one, else `code`. */
uint16_t machine_code_of(const struct axis *axis, uint16_t code);

#endif
