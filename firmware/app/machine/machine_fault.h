/* SPDX-License-Identifier: MIT */
/* machine_fault: how the machine enters a fault, goes through its phases and leaves it; machine.h declares the rest
 * (machine_raise, machine_note_emergency, machine_switch_off, machine_reset). Under the lock. */
#ifndef APP_MACHINE_MACHINE_FAULT_H
#define APP_MACHINE_MACHINE_FAULT_H

#include "app/machine/machine.h"

/* FAULT by quick stop, whatever the drives say. Any context. */
void machine_raise_quick(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* In FAULT: from braking to the quick stop. Any context. */
void machine_fault_quick(struct machine *machine);

/* One tick of quick stop, off or resetting; nothing while braking on the path. Timer. */
void machine_step_fault(struct machine *machine);

#endif
