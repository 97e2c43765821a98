/* SPDX-License-Identifier: MIT */
/* machine_fault: the phases of a fault in which no setpoints come from the program. */
#ifndef APP_MACHINE_MACHINE_FAULT_H
#define APP_MACHINE_MACHINE_FAULT_H

#include "app/machine/machine.h"

/* One tick of quick stop, off or resetting; nothing while braking on the path. Timer. */
void machine_step_fault(struct machine *machine);

#endif
