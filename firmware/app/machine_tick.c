/* SPDX-License-Identifier: MIT */
/* The machine's side of the tick: supervision of the drives, and the states that time moves on. */
#include "app/machine.h"

static bool enabled_expected(const struct machine *machine)
{
    return machine->state == MACHINE_READY ||
           (machine->state != MACHINE_FAULT && machine_moving(machine));
}

/* The drive's own words, when they have come, say more than "a fault". */
static uint16_t code_of_drive(const struct axis *axis)
{
    return axis->error_code != EMCY_NO_ERROR ? axis->error_code : EMCY_GENERIC;
}

static void supervise_axis(struct machine *machine, const struct axis *axis, uint32_t now_us)
{
    if (!axis->present) {
        return;
    }
    if (axis_lost(axis, now_us) && machine->state == MACHINE_OFF) {
        machine_enter_boot(machine); /* with power off they may come and go */
    } else if (axis_lost(axis, now_us)) {
        machine_raise(machine, EMCY_RPDO_TIMEOUT, axis->node, axis->missed_in_row);
    } else if (axis_in_fault(axis)) {
        machine_raise(machine, code_of_drive(axis), axis->node, axis->statusword);
    } else if (enabled_expected(machine) && !axis_enabled(axis)) {
        machine_raise(machine, FAULT_DROPPED_OUT, axis->node, axis->statusword);
    }
}

void machine_supervise(struct machine *machine, uint32_t now_us)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        if (axis_close_sync(axis) && machine_moving(machine)) {
            machine->statistics.missed_tpdos++;
        }
        if (machine->state != MACHINE_BOOT) {
            supervise_axis(machine, axis, now_us);
        }
    }
}

/* The first axis that is not yet where it shall be, or NULL. */
static const struct axis *straggler(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (machine->axes[i].present && !axis_reached(&machine->axes[i])) {
            return &machine->axes[i];
        }
    }
    return NULL;
}

static bool time_is_up(struct machine *machine)
{
    if (machine->ticks_left > 0u) {
        machine->ticks_left--;
    }
    return machine->ticks_left == 0u;
}

static void step_enabling(struct machine *machine)
{
    const struct axis *late = straggler(machine);
    if (late == NULL) {
        machine->state = MACHINE_READY;
    } else if (time_is_up(machine)) {
        machine_raise(machine, FAULT_NOT_ENABLED, late->node, late->statusword);
    }
}

static void next_targets(struct machine *machine)
{
    int32_t target_counts[PLANE_AXES];
    const int result = motion_step(&machine->motion, target_counts);
    if (result < 0) {
        machine->motion.timebase.state = TIMEBASE_STOPPED;
        machine_raise(machine, EMCY_SOFTWARE, 0, (uint32_t)-result);
        return;
    }
    for (uint8_t i = 0; i < PLANE_AXES; ++i) {
        machine->axes[i].target_counts = target_counts[i];
    }
    machine->statistics.program_tick = machine->motion.setpoints - 1u;
}

/* The drives move by themselves. */
static void step_homing(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        machine->axes[i].target_counts = machine->axes[i].position_counts;
    }
}

static void step_motion(struct machine *machine)
{
    if (!motion_over(&machine->motion)) {
        next_targets(machine);
        if (machine->state == MACHINE_HOLDING && motion_held(&machine->motion)) {
            machine->state = MACHINE_HELD;
        }
    } else if (time_is_up(machine)) {
        machine->state = MACHINE_READY;
    }
}

void machine_switch_off(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        machine->axes[i].goal = CIA402_GOAL_OFF;
    }
    machine->fault_phase = MACHINE_FAULT_OFF;
}

static void step_fault(struct machine *machine)
{
    if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
        next_targets(machine);
        if (motion_over(&machine->motion)) {
            machine_switch_off(machine);
        }
    } else if (machine->fault_phase == MACHINE_FAULT_RESETTING) {
        if (straggler(machine) == NULL || time_is_up(machine)) {
            machine->fault = (struct fault){.code = EMCY_NO_ERROR, .node = 0, .detail = 0};
            machine_enter_boot(machine);
        }
    }
}

void machine_step(struct machine *machine)
{
    switch (machine->state) {
    case MACHINE_ENABLING:
        step_enabling(machine);
        break;
    case MACHINE_RUNNING:
    case MACHINE_STOPPING:
    case MACHINE_HOLDING:
    case MACHINE_HELD:
        step_motion(machine);
        break;
    case MACHINE_HOMING:
        step_homing(machine);
        break;
    case MACHINE_FAULT:
        step_fault(machine);
        break;
    case MACHINE_BOOT:
        if (machine->configured && machine_drives_answer(machine)) {
            machine->state = MACHINE_OFF;
        }
        break;
    case MACHINE_OFF:
    case MACHINE_READY:
    case MACHINE_QUICK_STOP:
    default:
        break;
    }
}
