/* SPDX-License-Identifier: MIT */
#include "app/machine.h"

#include <string.h>

static void set_goals(struct machine *machine, enum cia402_goal goal)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        machine->axes[i].goal = goal;
        machine->axes[i].control_extra = 0;
    }
}

void machine_enter_boot(struct machine *machine)
{
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        axis_init(&machine->axes[i], machine->config.node[i]);
    }
    machine->state = MACHINE_BOOT;
    machine->configured = false;
    machine->boot_due = true;
}

void machine_init(struct machine *machine, const struct config *config)
{
    memset(machine, 0, sizeof *machine);
    machine->config = *config;
    machine->override_percent = 100;
    machine_enter_boot(machine);
}

bool machine_moving(const struct machine *machine)
{
    return machine->state == MACHINE_RUNNING || machine->state == MACHINE_STOPPING ||
           machine->state == MACHINE_HOLDING || machine->state == MACHINE_HELD ||
           (machine->state == MACHINE_FAULT && machine->fault_phase == MACHINE_FAULT_BRAKING);
}

bool machine_configurable(const struct machine *machine)
{
    return machine->state == MACHINE_BOOT || machine->state == MACHINE_OFF ||
           (machine->state == MACHINE_FAULT && machine->fault_phase == MACHINE_FAULT_OFF);
}

void machine_configure(struct machine *machine, const struct config *config, bool drives)
{
    machine->config = *config;
    if (drives && machine->state != MACHINE_FAULT) {
        machine_enter_boot(machine);
    }
}

void machine_drives_configured(struct machine *machine, bool simulated)
{
    if (machine->state == MACHINE_BOOT) {
        machine->simulated = simulated;
        machine->configured = true;
    }
}

/* What keeps every request but `stop` from being looked at any further. */
static enum machine_refusal not_available(const struct machine *machine)
{
    if (machine->state == MACHINE_FAULT) {
        return MACHINE_FAULT_PRESENT;
    }
    if (machine_moving(machine) || machine->state == MACHINE_HOMING) {
        return MACHINE_MOVING;
    }
    return machine->state == MACHINE_BOOT ? MACHINE_DRIVES_MISSING : MACHINE_ACCEPTED;
}

bool machine_drives_answer(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!machine->axes[i].present) {
            return false;
        }
    }
    return true;
}

enum machine_refusal machine_enable(struct machine *machine)
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED || machine->state != MACHINE_OFF) {
        return refusal;
    }
    set_goals(machine, CIA402_GOAL_ENABLED);
    machine->ticks_left = MACHINE_ENABLE_TICKS;
    machine->state = MACHINE_ENABLING;
    return MACHINE_ACCEPTED;
}

enum machine_refusal machine_disable(struct machine *machine)
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal == MACHINE_ACCEPTED) {
        set_goals(machine, CIA402_GOAL_OFF);
        machine->state = MACHINE_OFF;
    }
    return refusal;
}

enum machine_refusal machine_request_stop(struct machine *machine)
{
    if (machine->state == MACHINE_RUNNING || machine->state == MACHINE_HOLDING ||
        machine->state == MACHINE_HELD) {
        motion_stop(&machine->motion);
        machine->state = MACHINE_STOPPING;
    } else if (machine->state == MACHINE_ENABLING) {
        return machine_disable(machine);
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

enum machine_refusal machine_begin_homing(struct machine *machine)
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    if (machine->state != MACHINE_OFF) {
        return MACHINE_DRIVES_ON;
    }
    machine->state = MACHINE_HOMING;
    return MACHINE_ACCEPTED;
}

void machine_end_homing(struct machine *machine)
{
    if (machine->state == MACHINE_HOMING) {
        set_goals(machine, CIA402_GOAL_OFF);
        machine->state = MACHINE_OFF;
    }
}

void machine_override(struct machine *machine, uint32_t percent)
{
    machine->override_percent = percent;
    if (machine_moving(machine)) {
        motion_override(&machine->motion, percent);
    }
}

enum machine_refusal machine_reset(struct machine *machine)
{
    if (machine->state != MACHINE_FAULT || machine->fault_phase == MACHINE_FAULT_RESETTING) {
        return MACHINE_ACCEPTED;
    }
    if (machine->fault_phase == MACHINE_FAULT_BRAKING) {
        return MACHINE_MOVING;
    }
    set_goals(machine, CIA402_GOAL_RESET);
    machine->ticks_left = MACHINE_RESET_TICKS;
    machine->fault_phase = MACHINE_FAULT_RESETTING;
    return MACHINE_ACCEPTED;
}

static enum machine_refusal start_refusal(const struct machine *machine,
                                          const int32_t start_counts[PLANE_AXES])
{
    const enum machine_refusal refusal = not_available(machine);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    if (machine->state != MACHINE_READY) {
        return MACHINE_DRIVES_OFF;
    }
    if (machine->config.axis_count < PLANE_AXES) {
        return MACHINE_DRIVES_MISSING;
    }
    const uint32_t tolerance_counts = machine->config.start_tolerance_counts;
    for (uint8_t i = 0; i < PLANE_AXES; ++i) {
        if (axis_distance(&machine->axes[i], start_counts[i]) > tolerance_counts) {
            return MACHINE_AWAY_FROM_START;
        }
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_still(&machine->axes[i])) {
            return MACHINE_MOVING;
        }
    }
    return MACHINE_ACCEPTED;
}

enum machine_refusal machine_start(struct machine *machine, const struct motion *prepared,
                                   const int32_t start_counts[PLANE_AXES])
{
    const enum machine_refusal refusal = start_refusal(machine, start_counts);
    if (refusal == MACHINE_ACCEPTED) {
        machine->motion = *prepared;
        motion_override(&machine->motion, machine->override_percent);
        machine->ticks_left = MACHINE_SETTLE_TICKS;
        statistics_restart(&machine->statistics);
        machine->state = MACHINE_RUNNING;
    }
    return refusal;
}

void machine_raise(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    if (machine->state == MACHINE_FAULT) {
        return;
    }
    machine->fault = (struct fault){.code = code, .node = node, .detail = detail};
    if (machine_moving(machine) && !motion_over(&machine->motion)) {
        motion_stop(&machine->motion);
        machine->fault_phase = MACHINE_FAULT_BRAKING;
    } else {
        set_goals(machine, CIA402_GOAL_OFF);
        machine->fault_phase = MACHINE_FAULT_OFF;
    }
    machine->state = MACHINE_FAULT;
}

bool machine_drives_operational(const struct machine *machine)
{
    return machine->state != MACHINE_BOOT;
}

bool machine_busy(const struct machine *machine)
{
    if (machine->state != MACHINE_READY && machine->state != MACHINE_HELD) {
        return machine->state == MACHINE_ENABLING || machine->state == MACHINE_HOMING ||
               machine_moving(machine);
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_still(&machine->axes[i])) {
            return true;
        }
    }
    return false;
}

struct axis *machine_axis(struct machine *machine, uint8_t node)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (machine->axes[i].node == node) {
            return &machine->axes[i];
        }
    }
    return NULL;
}

bool machine_awaits_drives(const struct machine *machine)
{
    if (machine->state == MACHINE_BOOT || !machine->simulated) {
        return false;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (machine->axes[i].missed_in_row <= AXIS_MISSED_MAX) {
            return true;
        }
    }
    return false;
}

/* A drive that was silent for long is not waited for: the others have to be braked in time. */
static bool all_answered(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (!axis->answered && axis->missed_in_row <= AXIS_MISSED_MAX) {
            return false;
        }
    }
    return true;
}

bool machine_receive(struct machine *machine, const struct can_msg *in, uint32_t now_us)
{
    struct pdo_actual actual;
    const int node = pdo_decode_actual(in, &actual);
    struct axis *axis = node > 0 ? machine_axis(machine, (uint8_t)node) : NULL;
    if (axis == NULL || (machine->state == MACHINE_BOOT && !machine->configured)) {
        return false;
    }
    axis_receive(axis, &actual, now_us);
    return all_answered(machine);
}
