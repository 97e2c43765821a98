/* SPDX-License-Identifier: MIT */
#include "app/commands.h"

#include "port/port.h"

static enum machine_refusal locked(struct machine *machine,
                                   enum machine_refusal (*request)(struct machine *))
{
    port_lock();
    const enum machine_refusal refusal = request(machine);
    port_unlock();
    return refusal;
}

/* Everything that takes long (program check, reading all pieces) happens before the lock. */
static enum machine_refusal start(struct controller *controller)
{
    struct program_slot *slot = &controller->slot;
    if (!slot->present) {
        return MACHINE_NO_PROGRAM;
    }
    program_slot_refresh(slot, &controller->config);
    if (!slot->acceptable) {
        return MACHINE_OUTSIDE_LIMITS;
    }
    struct motion prepared;
    if (motion_begin(&prepared, &slot->program, &controller->config) != 0) {
        return MACHINE_OUTSIDE_LIMITS;
    }
    port_lock();
    const enum machine_refusal refusal =
        machine_start(&controller->machine, &prepared, slot->start_counts);
    port_unlock();
    return refusal;
}

static enum machine_refusal dispatch(struct controller *controller, enum command command)
{
    struct machine *machine = &controller->machine;
    switch (command) {
    case COMMAND_ENABLE:
        return locked(machine, machine_enable);
    case COMMAND_START:
        return start(controller);
    case COMMAND_DISABLE:
        return locked(machine, machine_disable);
    case COMMAND_RESET:
        return locked(machine, machine_reset);
    case COMMAND_STOP:
    default:
        return locked(machine, machine_request_stop);
    }
}

enum machine_refusal commands_execute(struct controller *controller, enum command command)
{
    controller->refusal = dispatch(controller, command);
    return controller->refusal;
}
