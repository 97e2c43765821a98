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

/* The start of the program is exactly the image's point; anywhere else the kernel says where. */
static int prepare(struct controller *controller, int64_t from_q40_mm, struct motion *prepared,
                   int32_t start_counts[PLANE_AXES])
{
    const struct program_slot *slot = &controller->slot;
    const int result =
        motion_begin_at(prepared, &slot->program, &controller->config, from_q40_mm, start_counts);
    if (from_q40_mm <= 0) {
        start_counts[0] = slot->start_counts[0];
        start_counts[1] = slot->start_counts[1];
    }
    return result;
}

/* Everything that takes long (program check, reading all pieces) happens before the lock. */
static enum machine_refusal start(struct controller *controller, int64_t from_q40_mm)
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
    int32_t start_counts[PLANE_AXES];
    if (prepare(controller, from_q40_mm, &prepared, start_counts) != 0) {
        return MACHINE_OUTSIDE_LIMITS;
    }
    port_lock();
    const enum machine_refusal refusal =
        machine_start(&controller->machine, &prepared, start_counts);
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
        return start(controller, 0);
    case COMMAND_START_FROM:
        return start(controller, controller->values.start_position);
    case COMMAND_HOLD:
        return locked(machine, machine_hold);
    case COMMAND_RESUME:
        return locked(machine, machine_resume);
    case COMMAND_DISABLE:
        return locked(machine, machine_disable);
    case COMMAND_HOME:
        return homing_begin(&controller->homing, machine, controller->boot.facts);
    case COMMAND_RESET:
        return locked(machine, machine_reset);
    case COMMAND_QUICK_STOP:
        return locked(machine, machine_quick_stop);
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
