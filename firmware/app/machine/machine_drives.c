/* SPDX-License-Identifier: MIT */
/* Implements app/machine/machine_drives.h (see there): all drives of a machine at once. Used by app/machine only. Under
 * the lock, any context. Changes only the goals of the axes; no I/O. */
#include "app/machine/machine_drives.h"

void machine_command(struct machine *machine, enum cia402_goal goal)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        axis_command(&machine->axes[i], goal);
    }
}

bool machine_followed(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_follows(&machine->axes[i])) {
            return false;
        }
    }
    return machine->unsent_ticks <= MACHINE_UNSENT_MAX;
}

bool machine_any_moves(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (!axis->tpdo1.lost && axis_moves(axis)) {
            return true;
        }
    }
    return false;
}

const struct axis *machine_not_stopped(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (!axis_has_stopped(&machine->axes[i])) {
            return &machine->axes[i];
        }
    }
    return NULL;
}

const struct axis *machine_not_arrived(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (axis_deviation_counts(axis) > config_tolerance_counts(&machine->config, i)) {
            return axis;
        }
    }
    return NULL;
}

const struct axis *machine_late_drive(const struct machine *machine)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (axis->tpdo1.present && !axis->tpdo1.lost && !axis_reached(axis)) {
            return axis;
        }
    }
    return NULL;
}

uint16_t machine_code_of(const struct axis *axis, uint16_t code)
{
    return fault_is_drives(axis->error_code) && fault_is_vague(code) ? axis->error_code : code;
}
