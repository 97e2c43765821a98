/* SPDX-License-Identifier: MIT */
/* The machine's way into FAULT, through its phases, and out of it. */
#include "app/machine/machine.h"

#include "app/machine/machine_private.h"

static void set_fault(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    machine->fault = (struct fault){.code = code, .node = node, .detail = detail};
    machine->fault_serial++;
}

bool machine_obeyed(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_obeys(&machine->axes[i])) {
            return false;
        }
    }
    return machine->unsent_ticks <= MACHINE_UNSENT_MAX;
}

const struct axis *machine_not_stopped(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_left(&machine->axes[i])) {
            return &machine->axes[i];
        }
    }
    return NULL;
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
        set_fault(machine, code, node, detail);
        machine_fault_quick(machine);
        machine->state = MACHINE_FAULT;
    } else if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
        machine_fault_quick(machine);
    }
}

static void brake_on_path(struct machine *machine)
{
    motion_stop(&machine->motion);
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
        set_fault(machine, code, node, detail);
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
    const struct fault *fault = &machine->fault;
    if (fault->node == node && code != EMCY_NO_ERROR && fault_is_vague(fault->code)) {
        set_fault(machine, code, node, fault->detail);
    }
}

/* A drive that does not answer may still hear, and brake: power is not taken from it. */
void machine_switch_off(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        axis_command(axis, axis->answers.lost ? CIA402_GOAL_QUICK_STOP : CIA402_GOAL_OFF);
    }
    machine->fault_phase = MACHINE_FAULT_OFF;
}

enum machine_refusal machine_reset(struct machine *machine)
{
    if (machine->state != MACHINE_FAULT || machine->fault_phase == MACHINE_FAULT_RESETTING) {
        return MACHINE_ACCEPTED;
    }
    if (machine->fault_phase != MACHINE_FAULT_OFF) {
        return MACHINE_MOVING;
    }
    machine_command(machine, CIA402_GOAL_RESET);
    machine->ticks_left = MACHINE_RESET_TICKS;
    machine->fault_phase = MACHINE_FAULT_RESETTING;
    return MACHINE_ACCEPTED;
}

static void step_braking(struct machine *machine)
{
    if (!machine_obeyed(machine)) {
        machine_fault_quick(machine);
    } else if (!motion_over(&machine->motion)) {
        machine_next_targets(machine);
    } else if (machine_time_is_up(machine)) {
        machine_switch_off(machine);
    }
}

/* The fault again, with its reason as it is now. */
static void step_not_reset(struct machine *machine, const struct axis *axis)
{
    set_fault(machine, machine_code_of(axis, EMCY_GENERIC), axis->node, axis->statusword);
    machine_switch_off(machine);
}

/* A drive that does not answer at all is left to BOOT, which looks for it and tells what is wrong. */
static void step_resetting(struct machine *machine)
{
    const struct axis *late = machine_straggler(machine);
    const bool unsent = machine->unsent_ticks > MACHINE_UNSENT_MAX;
    if (late != NULL && !machine_time_is_up(machine)) {
        return;
    }
    if (unsent) {
        set_fault(machine, FAULT_NOT_SENT, 0, machine->unsent_ticks);
        machine_switch_off(machine);
    } else if (late != NULL) {
        step_not_reset(machine, late);
    } else {
        set_fault(machine, EMCY_NO_ERROR, 0, 0);
        machine_enter_boot(machine);
    }
}

void machine_step_fault(struct machine *machine)
{
    switch (machine->fault_phase) {
    case MACHINE_FAULT_BRAKING:
        step_braking(machine);
        break;
    case MACHINE_FAULT_QUICK:
        if (machine_not_stopped(machine) == NULL || machine_time_is_up(machine)) {
            machine_switch_off(machine);
        }
        break;
    case MACHINE_FAULT_RESETTING:
        step_resetting(machine);
        break;
    case MACHINE_FAULT_OFF:
    default:
        break;
    }
}
