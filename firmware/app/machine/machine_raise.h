/* SPDX-License-Identifier: MIT */
/* machine_raise: the way into a fault, beside what machine.h has of it. Under the lock, any context. */
#ifndef APP_MACHINE_MACHINE_RAISE_H
#define APP_MACHINE_MACHINE_RAISE_H

#include "app/machine/machine.h"

/* What 0x2003 says, and that it has changed. */
void machine_set_fault(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* FAULT by quick stop, whatever the drives say. */
void machine_raise_quick(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* In FAULT: from braking to the quick stop. */
void machine_fault_quick(struct machine *machine);

#endif
