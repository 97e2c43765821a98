/* SPDX-License-Identifier: MIT */
/* The way into a fault: which reaction it gets, and what replaces its reason. */
#include "app/machine/machine_raise.h"

#include "app/machine/machine_drives.h"

#define EMCY_CLASS 0xFF00u

void machine_set_fault(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    machine->fault = (struct fault){.code = code, .node = node, .detail = detail};
    machine->fault_serial++;
}

void machine_fault_quick(struct machine *machine)
{
    machine_command(machine, CIA402_GOAL_QUICK_STOP);
    machine->ticks_left = MACHINE_QUICK_TICKS;
    machine->fault_phase = MACHINE_FAULT_QUICK;
}

void machine_raise_quick(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    if (machine->state != MACHINE_FAULT) {
        machine_set_fault(machine, code, node, detail);
        machine_fault_quick(machine);
        machine->state = MACHINE_FAULT;
    } else if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
        machine_fault_quick(machine);
    }
}

static void brake_on_path(struct machine *machine)
{
    motion_fault_stop(&machine->motion);
    machine->ticks_left = MACHINE_SETTLE_TICKS;
    machine->fault_phase = MACHINE_FAULT_BRAKING;
    machine->state = MACHINE_FAULT;
}

void machine_raise(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    const bool obeyed = machine_on_path(machine) && machine_obeyed(machine);
    if (!obeyed) {
        machine_raise_quick(machine, code, node, detail);
    } else if (machine->state != MACHINE_FAULT) {
        machine_set_fault(machine, code, node, detail);
        brake_on_path(machine);
    }
}

void machine_note_emergency(struct machine *machine, uint8_t node, uint16_t code)
{
    struct axis *axis = machine_axis(machine, node);
    if (axis == NULL) {
        return;
    }
    axis->error_code = code;
    if ((code & EMCY_CLASS) == EMCY_POSITION_SENSOR) { /* an encoder that fails loses count */
        axis->homed = false;
    }
    const struct fault *fault = &machine->fault;
    if (fault->node == node && code != EMCY_NO_ERROR && fault_is_vague(fault->code)) {
        machine_set_fault(machine, code, node, fault->detail);
    }
}

/* A drive that does not answer may still hear, and brake; one that moves yet would coast: power is not taken from them. */
void machine_switch_off(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        const bool brakes = axis->answers.lost || axis_moves(axis);
        axis_command(axis, brakes ? CIA402_GOAL_QUICK_STOP : CIA402_GOAL_OFF);
    }
    machine->fault_phase = MACHINE_FAULT_OFF;
}
