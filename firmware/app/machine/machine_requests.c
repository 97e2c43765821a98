/* SPDX-License-Identifier: MIT */
/* The requests of app/machine/machine.h: commands of the operator, from app/commands.c (main loop, under the lock).
 * Each changes the state, or returns why not. docs/reference/architecture.md section 4 has the table of requests by
 * state. Used by firmware/app. Guarded by the port's lock as a whole. Files use each other in one direction: tick,
 * supervise and requests -> fault -> drives -> machine. Changes only the machine; no I/O. */
#include "app/machine/machine.h"

#include "app/machine/machine_drives.h"
#include "app/machine/machine_fault.h"

/* The reason for which most requests are refused; MACHINE_ACCEPTED: none. */
static enum machine_refusal not_available(const struct machine *machine)
{
    if (machine->state == MACHINE_FAULT) {
        return MACHINE_FAULT_PRESENT;
    }
    if (machine_moving(machine)) {
        return MACHINE_MOVING;
    }
    return machine->state == MACHINE_BOOT ? MACHINE_DRIVES_MISSING : MACHINE_ACCEPTED;
}

/* Encoder noise and rounding beyond the travel, as the start tolerance allows it for a start. A drive that is switched
 * on farther outside moves to its software limit (0x607D) at once, without a ramp. */
static bool any_outside_travel(const struct machine *machine)
{
    const struct config *config = &machine->config;
    for (uint32_t i = 0; i < config->axis_count; ++i) {
        const int64_t position_counts = machine->axes[i].position_counts;
        const int64_t slack_counts = config_tolerance_counts(config, i);
        if (position_counts < config->travel[i].min_counts - slack_counts ||
            position_counts > config->travel[i].max_counts + slack_counts) {
            return true;
        }
    }
    return false;
}

enum machine_refusal machine_enable(struct machine *machine)
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED || machine->state != MACHINE_OFF) {
        return refusal;
    }
    if (any_outside_travel(machine)) {
        return MACHINE_OUTSIDE_TRAVEL;
    }
    machine_command(machine, CIA402_GOAL_ENABLED);
    machine->ticks_left = MACHINE_ENABLE_TICKS;
    machine->state = MACHINE_ENABLING;
    return MACHINE_ACCEPTED;
}

enum machine_refusal machine_disable(struct machine *machine)
{
    machine->stop_commands++;
    if (machine->state == MACHINE_HOMING) {
        return machine_quick_stop(machine);
    }
    const enum machine_refusal refusal = not_available(machine);
    if (refusal == MACHINE_ACCEPTED && machine_any_moves(machine)) {
        return machine_quick_stop(machine);
    }
    if (refusal == MACHINE_ACCEPTED) {
        machine_command(machine, CIA402_GOAL_OFF);
        machine->state = MACHINE_OFF;
    }
    return refusal;
}

enum machine_refusal machine_quick_stop(struct machine *machine)
{
    machine->stop_commands++;
    if (machine->state == MACHINE_FAULT) {
        if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
            machine_fault_quick(machine);
        }
    } else if (machine->state != MACHINE_BOOT && machine->state != MACHINE_OFF &&
               machine->state != MACHINE_QUICK_STOP) {
        machine->mode_left = machine->state == MACHINE_HOMING;
        machine_command(machine, CIA402_GOAL_QUICK_STOP);
        machine->ticks_left = MACHINE_QUICK_TICKS;
        machine->state = MACHINE_QUICK_STOP;
    }
    return MACHINE_ACCEPTED;
}

/* Whether the outputs stay on at a stop at standstill. It also ends the job whose end would switch them off. */
static bool outputs_stay_at_stop(const struct machine *machine)
{
    const uint32_t behaviour = machine->config.outputs.behaviour;
    return (behaviour & CONFIG_OUTPUTS_KEEP_AT_STOP) != 0u &&
           (behaviour & CONFIG_OUTPUTS_OFF_AT_END) == 0u;
}

/* At once, since the next tick may end the motion: then it never sees the state stopping. */
static void stop_outputs(struct machine *machine)
{
    machine->outputs_stay = false;
    if ((machine->config.outputs.behaviour & CONFIG_OUTPUTS_KEEP_AT_STOP) == 0u) {
        path_outputs_clear(&machine->motion.outputs);
    }
}

enum machine_refusal machine_request_stop(struct machine *machine)
{
    machine->stop_commands++;
    if (machine->state == MACHINE_RUNNING || machine->state == MACHINE_HOLDING ||
        machine->state == MACHINE_HELD) {
        motion_stop(&machine->motion);
        stop_outputs(machine);
        machine->state = MACHINE_STOPPING;
    } else if (machine->state == MACHINE_ENABLING) {
        return machine_disable(machine);
    } else if (machine->state == MACHINE_HOMING) {
        return machine_quick_stop(machine);
    } else if (machine->state == MACHINE_READY && !outputs_stay_at_stop(machine)) {
        path_outputs_clear(&machine->motion.outputs);
    }
    return MACHINE_ACCEPTED;
}

static enum machine_refusal nothing_runs(const struct machine *machine)
{
    return machine->state == MACHINE_FAULT ? MACHINE_FAULT_PRESENT : MACHINE_NOT_RUNNING;
}

enum machine_refusal machine_hold(struct machine *machine)
{
    if (machine->state == MACHINE_HOLDING || machine->state == MACHINE_HELD) {
        return MACHINE_ACCEPTED;
    }
    if (machine->state != MACHINE_RUNNING) {
        return nothing_runs(machine);
    }
    motion_hold(&machine->motion);
    machine->state = MACHINE_HOLDING;
    return MACHINE_ACCEPTED;
}

enum machine_refusal machine_resume(struct machine *machine)
{
    if (machine->state == MACHINE_RUNNING) {
        return MACHINE_ACCEPTED;
    }
    if (machine->state != MACHINE_HOLDING && machine->state != MACHINE_HELD) {
        return nothing_runs(machine);
    }
    motion_resume(&machine->motion);
    machine->state = MACHINE_RUNNING;
    return MACHINE_ACCEPTED;
}

bool machine_take_over(struct machine *machine, const struct chunk *next,
                       const struct coefficients_window *window)
{
    const bool goes_on = machine->state == MACHINE_RUNNING || machine->state == MACHINE_HOLDING ||
                         machine->state == MACHINE_HELD;
    return goes_on && motion_take_over(&machine->motion, next, window);
}

enum machine_refusal machine_begin_homing(struct machine *machine)
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    if (machine->state != MACHINE_OFF) {
        return MACHINE_DRIVES_ON;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        machine->axes[i].moves_by_drive = true;
    }
    machine->state = MACHINE_HOMING;
    return MACHINE_ACCEPTED;
}

void machine_end_homing(struct machine *machine)
{
    if (machine->state == MACHINE_HOMING) {
        machine_command(machine, CIA402_GOAL_OFF);
        machine->state = MACHINE_OFF;
    }
}

bool machine_set_outputs(struct machine *machine, const struct path_outputs_values *values)
{
    const bool possible = machine->state == MACHINE_READY && machine->config.outputs.node != 0u;
    if (possible) {
        path_outputs_set(&machine->motion.outputs, values);
    }
    return possible;
}

void machine_override(struct machine *machine, uint32_t percent)
{
    machine->override_percent = percent;
    if (machine_on_path(machine)) {
        motion_override(&machine->motion, percent);
    }
}

uint8_t machine_unhomed(const struct machine *machine)
{
    uint8_t axes = 0;
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const bool wanted = machine->config.axis[i].homing_method != 0;
        axes |= (uint8_t)(wanted && !machine->axes[i].homed ? 1u << i : 0u);
    }
    return axes;
}

static enum machine_refusal start_refusal(const struct machine *machine,
                                          const struct motion *prepared,
                                          const int32_t start_counts[AXES_MAX])
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    if (machine->state != MACHINE_READY) {
        return MACHINE_DRIVES_OFF;
    }
    if (machine->config.axis_count < motion_axes_end(prepared)) {
        return MACHINE_AXES_MISSING;
    }
    if (!machine->unhomed_allowed && machine_unhomed(machine) != 0u) {
        return MACHINE_NOT_HOMED;
    }
    for (uint32_t i = motion_first_axis(prepared); i < motion_axes_end(prepared); ++i) {
        const uint32_t tolerance_counts = config_tolerance_counts(&machine->config, i);
        if (axis_distance(&machine->axes[i], start_counts[i]) > tolerance_counts) {
            return MACHINE_AWAY_FROM_START;
        }
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_stands(&machine->axes[i])) {
            return MACHINE_MOVING;
        }
    }
    return MACHINE_ACCEPTED;
}

enum machine_refusal machine_start(struct machine *machine, const struct motion *prepared,
                                   const int32_t start_counts[AXES_MAX])
{
    const enum machine_refusal refusal = start_refusal(machine, prepared, start_counts);
    if (refusal == MACHINE_ACCEPTED) {
        machine->motion = *prepared;
        machine->unhomed_axes = machine_unhomed(machine);
        motion_override(&machine->motion, machine->override_percent);
        machine->ticks_left = MACHINE_SETTLE_TICKS;
        machine->arriving_ticks = 0;
        statistics_restart(&machine->statistics);
        machine->state = MACHINE_RUNNING;
    }
    return refusal;
}
