/* SPDX-License-Identifier: MIT */
/* machine_private: what the files of the machine share. Under the lock, any context. */
#ifndef APP_MACHINE_MACHINE_PRIVATE_H
#define APP_MACHINE_MACHINE_PRIVATE_H

#include "app/machine/machine.h"

/* The same goal for all axes. */
void machine_command(struct machine *machine, enum cia402_goal goal);

/* Counts ticks_left down; true when there are none left. */
bool machine_time_is_up(struct machine *machine);

/* Whether every drive answers, is enabled and follows its target, and frames reach them. */
bool machine_obeyed(const struct machine *machine);

/* The first drive that still moves by its own power, or NULL. */
const struct axis *machine_not_stopped(const struct machine *machine);

/* The first drive that answers but is not yet where it shall be, or NULL. */
const struct axis *machine_straggler(const struct machine *machine);

/* The drive's own emergency code, when it has sent one, else `code`. */
uint16_t machine_code_of(const struct axis *axis, uint16_t code);

/* Next setpoints of the plane's axes. */
void machine_next_targets(struct machine *machine);

/* FAULT by quick stop, whatever the drives say. */
void machine_raise_quick(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* In FAULT: from braking to the quick stop. */
void machine_fault_quick(struct machine *machine);

/* One tick in FAULT. */
void machine_step_fault(struct machine *machine);

#endif
