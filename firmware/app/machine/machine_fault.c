/* SPDX-License-Identifier: MIT */
/* The machine's way through the phases of a fault, and out of it; into it: machine_raise.c. */
#include "app/machine/machine_fault.h"

#include "app/machine/machine_drives.h"
#include "app/machine/machine_raise.h"

enum machine_refusal machine_reset(struct machine *machine)
{
    if (machine->state == MACHINE_OFF) { /* nobody knows what somebody else has told the drives */
        machine_enter_boot(machine);
    }
    if (machine->state != MACHINE_FAULT || machine->fault_phase == MACHINE_FAULT_RESETTING) {
        return MACHINE_ACCEPTED;
    }
    if (machine->fault_phase != MACHINE_FAULT_OFF || machine_any_moves(machine)) {
        return MACHINE_MOVING;
    }
    machine_command(machine, CIA402_GOAL_RESET);
    machine->ticks_left = MACHINE_RESET_TICKS;
    machine->fault_phase = MACHINE_FAULT_RESETTING;
    return MACHINE_ACCEPTED;
}

/* The fault again, with its reason as it is now. */
static void step_not_reset(struct machine *machine, const struct axis *axis)
{
    machine_set_fault(machine, machine_code_of(axis, EMCY_GENERIC), axis->node, axis->statusword);
    machine_switch_off(machine);
}

/* In Fault, says its statusword, and so did its EMCY: a statusword alone may come from a mapping that is not ours. */
static bool stays_in_fault(const struct axis *axis)
{
    return axis_in_fault(axis) && axis->error_code != EMCY_NO_ERROR;
}

/* A drive that does not answer at all, or not what it was asked, is left to BOOT, which looks for it, configures it anew and
 * tells what is wrong. */
static void step_resetting(struct machine *machine)
{
    const struct axis *late = machine_late_drive(machine);
    const bool unsent = machine->unsent_ticks > MACHINE_UNSENT_MAX;
    if (late != NULL && !machine_time_is_up(machine)) {
        return;
    }
    if (unsent) {
        machine_set_fault(machine, FAULT_NOT_SENT, 0, machine->unsent_ticks);
        machine_switch_off(machine);
    } else if (late != NULL && stays_in_fault(late)) {
        step_not_reset(machine, late);
    } else {
        machine_set_fault(machine, EMCY_NO_ERROR, 0, 0);
        machine_enter_boot(machine);
    }
}

void machine_step_fault(struct machine *machine)
{
    switch (machine->fault_phase) {
    case MACHINE_FAULT_QUICK:
        if (machine_not_stopped(machine) == NULL || machine_time_is_up(machine)) {
            machine_switch_off(machine);
        }
        break;
    case MACHINE_FAULT_RESETTING:
        step_resetting(machine);
        break;
    case MACHINE_FAULT_OFF:
    case MACHINE_FAULT_BRAKING:
    default:
        break;
    }
}
