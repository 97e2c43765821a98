/* SPDX-License-Identifier: MIT */
/* Implements app/machine/machine.h (see there): initial values, the parts of the machine, and its queries. Used by
 * firmware/app. Guarded by the port's lock as a whole. Files use each other in one direction: tick, supervise and
 * requests -> fault -> drives -> machine. Changes only the machine; no I/O. */
#include "app/machine/machine.h"

#include <string.h>

#define US_PER_MS 1000u

void machine_enter_boot(struct machine *machine)
{
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        axis_forget(&machine->axes[i], machine->config.node[i]);
    }
    machine->state = MACHINE_BOOT;
    machine->configured = false;
    machine->mode_left = false;
    machine->unresponsive_node = 0;
    machine->boot_due = true;
}

void machine_init(struct machine *machine, const struct config *config)
{
    memset(machine, 0, sizeof *machine);
    machine->config = *config;
    machine->override_percent = 100;
    machine->setpoints_sent = true;
    machine_enter_boot(machine);
}

static bool in_fault_phase(const struct machine *machine, enum machine_fault_phase phase)
{
    return machine->state == MACHINE_FAULT && machine->fault_phase == phase;
}

bool machine_on_path(const struct machine *machine)
{
    return machine->state == MACHINE_RUNNING || machine->state == MACHINE_STOPPING ||
           machine->state == MACHINE_HOLDING || machine->state == MACHINE_HELD ||
           in_fault_phase(machine, MACHINE_FAULT_BRAKING);
}

bool machine_moving(const struct machine *machine)
{
    return machine_on_path(machine) || machine->state == MACHINE_HOMING ||
           machine->state == MACHINE_QUICK_STOP || in_fault_phase(machine, MACHINE_FAULT_QUICK);
}

bool machine_configurable(const struct machine *machine)
{
    return machine->state == MACHINE_BOOT || machine->state == MACHINE_OFF ||
           in_fault_phase(machine, MACHINE_FAULT_OFF);
}

void machine_configure(struct machine *machine, const struct config *config, bool drives)
{
    for (uint8_t i = machine->config.axis_count; i < config->axis_count; ++i) {
        axis_init(&machine->axes[i], config->node[i]);
    }
    for (uint8_t i = 0; i < config->axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        axis->homed = axis->homed && config_same_zero(&machine->config, config, i);
    }
    machine->config = *config;
    if (drives && machine->state != MACHINE_FAULT) {
        machine_enter_boot(machine);
    }
}

void machine_drives_configured(struct machine *machine, bool simulated)
{
    if (machine->state == MACHINE_BOOT) {
        machine->simulated = simulated;
        machine->ticks_left = MACHINE_ANSWER_TICKS;
        machine->configured = true;
    }
}

bool machine_drives_answer(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!machine->axes[i].tpdo1.present) {
            return false;
        }
    }
    return true;
}

bool machine_waits_for_chunk(const struct machine *machine)
{
    return (machine->state == MACHINE_RUNNING || machine->state == MACHINE_HOLDING ||
            machine->state == MACHINE_HELD) &&
           motion_waits(&machine->motion);
}

bool machine_busy(const struct machine *machine)
{
    const bool rests = machine->state == MACHINE_READY || machine->state == MACHINE_HELD ||
                       machine_waits_for_chunk(machine);
    if (!rests) {
        return machine->state == MACHINE_ENABLING || machine_moving(machine);
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_stands(&machine->axes[i])) {
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

uint32_t machine_answer_wait_us(const struct machine *machine)
{
    const uint32_t wait_ms = machine->config.answer_wait_ms;
    const bool real = !machine->simulated && wait_ms > MACHINE_REAL_WAIT_MAX_MS;
    return (real ? MACHINE_REAL_WAIT_MAX_MS : wait_ms) * US_PER_MS;
}

/* Ticks do not wait for a lost drive: the others have to be braked in time. */
static bool all_answered(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct tpdo_monitor *monitor = &machine->axes[i].tpdo1;
        if (monitor->count == 0u && !monitor->lost) {
            return false;
        }
    }
    return true;
}

bool machine_awaits_drives(const struct machine *machine)
{
    if (machine->state == MACHINE_BOOT || !machine->simulated || !machine->sync_sent ||
        (machine->sync_waits && all_answered(machine))) {
        return false;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!machine->axes[i].tpdo1.lost) {
            return true;
        }
    }
    return false;
}

bool machine_receive(struct machine *machine, uint8_t node, const struct pdo_actual *actual,
                     uint32_t now_us)
{
    struct axis *axis = machine_axis(machine, node);
    if (axis == NULL || (machine->state == MACHINE_BOOT && !machine->configured)) {
        return false;
    }
    axis_receive(axis, actual, now_us);
    return all_answered(machine);
}

bool machine_time_is_up(struct machine *machine)
{
    if (machine->ticks_left > 0u) {
        machine->ticks_left--;
    }
    return machine->ticks_left == 0u;
}
