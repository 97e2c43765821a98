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
static enum machine_refusal prepare_start(struct controller *controller, int64_t from_q40_mm)
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
    controller->machine.unhomed_allowed = controller->values.start_without_homing.allowed != 0u;
    const enum machine_refusal refusal =
        machine_start(&controller->machine, &prepared, start_counts);
    port_unlock();
    return refusal;
}

/* What allows a start without homing is for one attempt. */
static enum machine_refusal start(struct controller *controller, int64_t from_q40_mm)
{
    const enum machine_refusal refusal = prepare_start(controller, from_q40_mm);
    controller->values.start_without_homing.allowed = 0;
    if (refusal == MACHINE_ACCEPTED && controller->machine.unhomed_axes != 0u) {
        port_log(PORT_WARNING, "started without homing, axes (bit 0: the first)",
                 controller->machine.unhomed_axes);
    }
    return refusal;
}

/* Wants a configuration, and a controller that stays. */
static bool begins_something(enum command command)
{
    return command == COMMAND_ENABLE || command == COMMAND_HOME || command == COMMAND_START ||
           command == COMMAND_START_FROM;
}

/* Real drives take no late SYNCs: they are not switched on where the operating system may make them late. */
static bool too_late_for_real_drives(const struct controller *controller)
{
    port_lock();
    const bool real = controller->machine.state == MACHINE_OFF && !controller->machine.simulated;
    port_unlock();
    return real && port_timing() == PORT_TIMING_REFUSED;
}

static enum machine_refusal enable(struct controller *controller)
{
    return too_late_for_real_drives(controller) ? MACHINE_NOT_IN_TIME
                                                : locked(&controller->machine, machine_enable);
}

static enum machine_refusal home(struct controller *controller)
{
    return too_late_for_real_drives(controller)
               ? MACHINE_NOT_IN_TIME
               : homing_begin(&controller->homing, &controller->machine, controller->boot.facts);
}

static enum machine_refusal dispatch(struct controller *controller, enum command command)
{
    struct machine *machine = &controller->machine;
    if (begins_something(command) && controller->ending) {
        return MACHINE_ENDING;
    }
    if (begins_something(command) && !controller_configured(controller)) {
        return MACHINE_NOT_CONFIGURED;
    }
    switch (command) {
    case COMMAND_ENABLE:
        return enable(controller);
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
        return home(controller);
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
