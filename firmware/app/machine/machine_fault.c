/* SPDX-License-Identifier: MIT */
/* Implements app/machine/machine_fault.h (see there): how the machine enters a fault, goes through its phases and
 * leaves it. Used by app/machine only; the public functions of machine_fault.c are in machine.h (machine_raise,
 * machine_note_emergency, machine_switch_off, machine_reset). Under the lock. Changes only the machine; no I/O. */
#include "app/machine/machine_fault.h"

#include "app/machine/machine_drives.h"

#define EMCY_CLASS 0xFF00u /* bits of an error code: its class */

/* ---- Into a fault: which reaction it gets, and what replaces its reason ---- */

/* Sets the content of 0x2003 and marks it as changed. */
static void set_fault(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
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
        set_fault(machine, code, node, detail);
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
    const bool followed = machine_on_path(machine) && machine_followed(machine);
    if (!followed) {
        machine_raise_quick(machine, code, node, detail);
    } else if (machine->state != MACHINE_FAULT) {
        set_fault(machine, code, node, detail);
        brake_on_path(machine);
    }
}

/* An output with a short or open circuit, or an error of the module itself. With the drives off it has no effect. */
static void note_module_error(struct machine *machine, uint8_t node, uint16_t code)
{
    const bool on = machine->state != MACHINE_BOOT && machine->state != MACHINE_OFF;
    if (node == machine->config.outputs.node && code != EMCY_NO_ERROR && on) {
        machine_raise(machine, code, node, 0);
    }
}

void machine_note_emergency(struct machine *machine, uint8_t node, uint16_t code)
{
    struct axis *axis = machine_axis(machine, node);
    if (axis == NULL) {
        note_module_error(machine, node, code);
        return;
    }
    axis->error_code = code;
    if ((code & EMCY_CLASS) == EMCY_POSITION_SENSOR) { /* an encoder that fails loses count */
        axis->homed = false;
    }
    const struct fault *fault = &machine->fault;
    if (fault->node == node && fault_is_drives(code) && fault_is_vague(fault->code)) {
        set_fault(machine, code, node, fault_drive_detail(code, (uint16_t)fault->detail));
    }
}

/* A drive that does not answer may still receive, and brake. A drive that still moves would coast without power. So
 * their power stays on. */
void machine_switch_off(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        const bool brakes = axis->tpdo1.lost || axis_moves(axis);
        axis_command(axis, brakes ? CIA402_GOAL_QUICK_STOP : CIA402_GOAL_OFF);
    }
    machine->fault_phase = MACHINE_FAULT_OFF;
}

/* ---- Its phases, and its end ---- */

enum machine_refusal machine_reset(struct machine *machine)
{
    if (machine->state == MACHINE_OFF) { /* another node may have changed the drives */
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
    const uint16_t code = machine_code_of(axis, EMCY_GENERIC);
    set_fault(machine, code, axis->node, fault_drive_detail(code, axis->statusword));
    machine_switch_off(machine);
}

/* In Fault by its statusword and by an EMCY: a statusword alone may come from a foreign PDO mapping. */
static bool stays_in_fault(const struct axis *axis)
{
    return axis_in_fault(axis) && axis->error_code != EMCY_NO_ERROR;
}

/* BOOT handles a drive that does not answer or has the wrong state: it searches the drive, configures it anew and
 * reports the error. */
static void step_resetting(struct machine *machine)
{
    const struct axis *late = machine_late_drive(machine);
    const bool unsent = machine->unsent_ticks > MACHINE_UNSENT_MAX;
    if (late != NULL && !machine_time_is_up(machine)) {
        return;
    }
    if (unsent) {
        set_fault(machine, FAULT_NOT_SENT, 0, machine->unsent_ticks);
        machine_switch_off(machine);
    } else if (late != NULL && stays_in_fault(late)) {
        step_not_reset(machine, late);
    } else {
        set_fault(machine, EMCY_NO_ERROR, 0, 0);
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
