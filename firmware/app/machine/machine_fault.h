/* SPDX-License-Identifier: MIT */
/* machine_fault: how the machine enters a fault, goes through its phases and leaves it. Used by app/machine only; the
 * public functions of machine_fault.c are in machine.h (machine_raise, machine_note_emergency, machine_switch_off,
 * machine_reset). Under the lock. Changes only the machine; no I/O. */
#ifndef APP_MACHINE_MACHINE_FAULT_H
#define APP_MACHINE_MACHINE_FAULT_H

#include "app/machine/machine.h"

/* FAULT with a quick stop, whatever the state of the drives. Any context. */
void machine_raise_quick(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* In FAULT: from braking to the quick stop. Any context. */
void machine_fault_quick(struct machine *machine);

/* One tick of quick stop, off or resetting; nothing while braking on the path. Timer. */
void machine_step_fault(struct machine *machine);

#endif
