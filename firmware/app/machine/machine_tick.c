/* SPDX-License-Identifier: MIT */
/* machine_step() of app/machine/machine.h: what each tick does in each state. Timer context, under the lock. Used by
 * firmware/app. Guarded by the port's lock as a whole. Files use each other in one direction: tick, supervise and
 * requests -> fault -> drives -> machine. Changes only the machine; no I/O. */
#include "app/machine/machine.h"

#include "app/machine/machine_drives.h"
#include "app/machine/machine_fault.h"

static uint8_t unresponsive_node(const struct machine *machine)
{
    uint8_t i = 0;
    while (i + 1u < machine->config.axis_count && machine->axes[i].tpdo1.present) {
        ++i;
    }
    return machine->axes[i].node;
}

/* A drive that is in Fault from the beginning. */
static void raise_found(struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (axis_in_fault(axis)) {
            const uint16_t code = machine_code_of(axis, EMCY_GENERIC);
            machine_raise(machine, code, axis->node, fault_drive_detail(code, axis->statusword));
            return;
        }
    }
}

/* During configuration no answers were expected. If none comes now, the NMT start may have been lost. */
static void step_boot(struct machine *machine)
{
    if (!machine->configured) {
        return;
    }
    if (!machine_drives_answer(machine)) {
        if (machine_time_is_up(machine)) {
            const uint8_t node = unresponsive_node(machine);
            machine_enter_boot(machine);
            machine->unresponsive_node = node;
        }
        return;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        tpdo_monitor_restart(&machine->axes[i].tpdo1);
    }
    machine->unresponsive_node = 0;
    machine->state = MACHINE_OFF;
    raise_found(machine);
}

static void step_enabling(struct machine *machine)
{
    const struct axis *late = machine_late_drive(machine);
    if (late == NULL) {
        machine->state = MACHINE_READY;
    } else if (machine_time_is_up(machine)) {
        machine_raise(machine, FAULT_NOT_ENABLED, late->node, late->statusword);
    }
}

/* Without a point no path stop is possible. */
static void next_targets(struct machine *machine)
{
    int32_t target_counts[AXES_MAX];
    if (motion_rests(&machine->motion)) {
        machine->statistics.program_tick = machine->motion.setpoints - 1u;
        return;
    }
    const int result = motion_step(&machine->motion, target_counts);
    if (result < 0) {
        machine_raise_quick(machine, EMCY_SOFTWARE, 0, (uint32_t)-result);
        return;
    }
    const uint32_t end = motion_axes_end(&machine->motion);
    for (uint32_t i = motion_first_axis(&machine->motion); i < end; ++i) {
        machine->axes[i].target_counts = target_counts[i];
    }
    machine->statistics.program_tick = machine->motion.setpoints - 1u;
}

/* A drive may have stopped by itself without a report: then the program has not been completed. */
static void step_arriving(struct machine *machine)
{
    const struct axis *away = machine_not_arrived(machine);
    if (away == NULL) {
        machine->state = MACHINE_READY;
    } else if (++machine->arriving_ticks > MACHINE_ARRIVE_TICKS) {
        machine_raise(machine, FAULT_POSITION_DEVIATION, away->node, axis_deviation_counts(away));
    }
}

static void step_motion(struct machine *machine)
{
    if (machine->clock_paused) {
        return;
    }
    if (!motion_over(&machine->motion)) {
        next_targets(machine);
        if (motion_late(&machine->motion)) {
            machine_raise_quick(machine, FAULT_STOP_LATE, 0, machine->statistics.program_tick);
        } else if (machine->state == MACHINE_HOLDING && motion_held(&machine->motion)) {
            machine->state = MACHINE_HELD;
        }
    } else if (machine_time_is_up(machine)) {
        step_arriving(machine);
    }
}

static void step_braking(struct machine *machine)
{
    if (!machine_followed(machine) || motion_late(&machine->motion)) {
        machine_fault_quick(machine);
    } else if (machine->clock_paused) {
        return;
    } else if (!motion_over(&machine->motion)) {
        next_targets(machine);
    } else if (machine_time_is_up(machine)) {
        if (machine_any_moves(machine)) {
            machine_fault_quick(machine);
        } else {
            machine_switch_off(machine);
        }
    }
}

static void step_fault(struct machine *machine)
{
    if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
        step_braking(machine);
    } else {
        machine_step_fault(machine);
    }
}

static void step_quick_stop(struct machine *machine)
{
    const struct axis *moving = machine_not_stopped(machine);
    if (moving != NULL) {
        if (machine_time_is_up(machine)) {
            machine_raise_quick(machine, FAULT_NOT_STOPPED, moving->node, moving->statusword);
            machine_switch_off(machine);
        }
    } else if (machine->mode_left) {
        machine_enter_boot(machine);
    } else {
        machine_command(machine, CIA402_GOAL_OFF);
        machine->state = MACHINE_OFF;
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
    case MACHINE_QUICK_STOP:
        step_quick_stop(machine);
        break;
    case MACHINE_FAULT:
        step_fault(machine);
        break;
    case MACHINE_BOOT:
        step_boot(machine);
        break;
    case MACHINE_OFF:
    case MACHINE_READY:
    case MACHINE_HOMING: /* controlled by the main loop */
    default:
        break;
    }
}
