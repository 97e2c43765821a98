/* SPDX-License-Identifier: MIT */
/* Implements app/commands.h (see there): the commands of objects 0x2001 and 0x2056. Called by app/objects and
 * app/controller. Main loop, outside the lock, which it takes; commands_execute_urgent within the lock,
 * command_urgent_request in the receive interrupt. Changes the controller and its machine; sends nothing itself. */
#include "app/commands.h"

#include <string.h>

#include "canopen/cob.h"
#include "core/first_axis.h"
#include "port/port.h"

static enum machine_refusal locked(struct machine *machine,
                                   enum machine_refusal (*request)(struct machine *))
{
    port_lock();
    const enum machine_refusal refusal = request(machine);
    port_unlock();
    return refusal;
}

/* A start at the beginning uses the start point stored in the image; a start elsewhere computes it. */
static int prepare(struct controller *controller, int64_t from_q40_mm, struct motion *prepared,
                   int32_t start_counts[AXES_MAX])
{
    const struct program_slot *slot = &controller->slot;
    const int result =
        motion_begin_at(prepared, &slot->program, &controller->config, from_q40_mm, start_counts);
    if (from_q40_mm <= 0) {
        memcpy(start_counts, slot->start_counts, sizeof slot->start_counts);
    }
    return result;
}

static enum machine_refusal prepare_any(struct controller *controller, int64_t from_q40_mm,
                                        struct motion *prepared, int32_t start_counts[AXES_MAX])
{
    if (stream_is_open(&controller->stream)) {
        return stream_prepare(&controller->stream, &controller->config, prepared, start_counts);
    }
    return prepare(controller, from_q40_mm, prepared, start_counts) == 0 ? MACHINE_ACCEPTED
                                                                         : MACHINE_OUTSIDE_LIMITS;
}

/* While axes move nothing is started, and the main loop has no time for the check of a program. */
static enum machine_refusal moving_refusal(const struct machine *machine)
{
    port_lock();
    const bool moving = machine_moving(machine);
    const bool fault = machine->state == MACHINE_FAULT;
    port_unlock();
    if (!moving) {
        return MACHINE_ACCEPTED;
    }
    return fault ? MACHINE_FAULT_PRESENT : MACHINE_MOVING;
}

/* What keeps the program from being started. Costs a check of it where it was not checked under this configuration:
 * apart from the start, so that the stack never holds the check and a prepared motion. */
static enum machine_refusal program_refusal(struct controller *controller)
{
    struct program_slot *slot = &controller->slot;
    if (!slot->present) {
        return MACHINE_NO_PROGRAM;
    }
    if (first_axis_end(&slot->program.header) > controller->config.axis_count) {
        return MACHINE_AXES_MISSING;
    }
    const enum machine_refusal refusal = program_slot_is_checked(slot, &controller->config)
                                             ? MACHINE_ACCEPTED
                                             : moving_refusal(&controller->machine);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    program_slot_refresh(slot, &controller->config);
    return slot->acceptable ? MACHINE_ACCEPTED : MACHINE_OUTSIDE_LIMITS;
}

/* A job starts at its beginning, once. */
static enum machine_refusal job_refusal(const struct controller *controller, enum command command)
{
    return command == COMMAND_START_FROM || controller->stream.started ? MACHINE_JOB_STARTED
                                                                       : MACHINE_ACCEPTED;
}

/* A host that prepares a start names the stop commands that it knows of: one that comes meanwhile is not lost. Under
 * the lock. */
static enum machine_refusal stopped_refusal(const struct controller *controller)
{
    const uint32_t expected = controller->values.stop_commands.expected;
    return expected == STOP_COMMANDS_ANY || expected == controller->machine.stop_commands
               ? MACHINE_ACCEPTED
               : MACHINE_STOPPED;
}

/* Reading all pieces takes long, so it happens before the lock. */
static enum machine_refusal start(struct controller *controller, int64_t from_q40_mm)
{
    struct motion prepared;
    int32_t start_counts[AXES_MAX];
    enum machine_refusal refusal = prepare_any(controller, from_q40_mm, &prepared, start_counts);
    if (refusal != MACHINE_ACCEPTED) {
        return refusal;
    }
    port_lock();
    refusal = stopped_refusal(controller);
    if (refusal == MACHINE_ACCEPTED) {
        controller->machine.unhomed_allowed = controller->values.start_without_homing.allowed != 0u;
        refusal = machine_start(&controller->machine, &prepared, start_counts);
    }
    if (refusal == MACHINE_ACCEPTED) {
        controller->machine.outputs_stay =
            controller->values.outputs_at_standstill.stay_at_end != 0u;
    }
    port_unlock();
    if (refusal == MACHINE_ACCEPTED && stream_is_open(&controller->stream)) {
        stream_started(&controller->stream);
    }
    if (refusal == MACHINE_ACCEPTED && controller->machine.unhomed_axes != 0u) {
        port_log(PORT_WARNING, "started without homing, axes (bit 0: the first)",
                 controller->machine.unhomed_axes);
    }
    return refusal;
}

static bool starts_program(enum command command)
{
    return command == COMMAND_START || command == COMMAND_START_FROM;
}

/* Commands that need a confirmed configuration, and a controller that is not being shut down. */
static bool begins_something(enum command command)
{
    return command == COMMAND_ENABLE || command == COMMAND_HOME || starts_program(command);
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
               : homing_begin(&controller->homing, &controller->machine,
                              controller->boot.properties);
}

/* What keeps the controller from beginning anything. */
static enum machine_refusal controller_refusal(const struct controller *controller)
{
    if (controller->ending) {
        return MACHINE_ENDING;
    }
    return controller_configured(controller) ? MACHINE_ACCEPTED : MACHINE_NOT_CONFIGURED;
}

static enum machine_refusal dispatch(struct controller *controller, enum command command)
{
    struct machine *machine = &controller->machine;
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

/* Whether the motion that would be started is the named one. Without any, the reason is that there is none. */
static bool is_named(const struct controller *controller, enum start_name name, uint32_t number)
{
    const bool job = stream_is_open(&controller->stream);
    switch (name) {
    case START_PROGRAM:
        return !job &&
               (!controller->slot.present || controller->slot.program.header.crc32 == number);
    case START_JOB:
        return job && controller->stream.job == number;
    case START_ANY:
    default:
        return true;
    }
}

static enum machine_refusal attempt_start(struct controller *controller, enum command command,
                                          enum start_name name, uint32_t number)
{
    if (!is_named(controller, name, number)) {
        return MACHINE_OTHER_PROGRAM;
    }
    const enum machine_refusal refusal = stream_is_open(&controller->stream)
                                             ? job_refusal(controller, command)
                                             : program_refusal(controller);
    return refusal == MACHINE_ACCEPTED ? dispatch(controller, command) : refusal;
}

static enum machine_refusal execute(struct controller *controller, enum command command,
                                    enum start_name name, uint32_t number)
{
    enum machine_refusal refusal =
        begins_something(command) ? controller_refusal(controller) : MACHINE_ACCEPTED;
    if (refusal == MACHINE_ACCEPTED) {
        refusal = starts_program(command) ? attempt_start(controller, command, name, number)
                                          : dispatch(controller, command);
    }
    if (starts_program(command)) { /* these are valid for one attempt, also a refused one */
        controller->values.start_without_homing.allowed = 0;
        controller->values.stop_commands.expected = STOP_COMMANDS_ANY;
        controller->values.outputs_at_standstill.stay_at_end = 0;
    }
    return refusal;
}

bool command_urgent_request(const struct can_msg *frame, uint8_t node)
{
    static const uint8_t request[4] = {0x2F, 0x01, 0x20, 0x00};
    static const uint8_t rest[3] = {0};
    return frame->id == COB_SDO_REQUEST + node && frame->len == CAN_DATA_MAX &&
           memcmp(frame->data, request, sizeof request) == 0 && command_is_urgent(frame->data[4]) &&
           memcmp(frame->data + 5, rest, sizeof rest) == 0;
}

void commands_execute_urgent(struct machine *machine, uint16_t set)
{
    if ((set & 1u << COMMAND_HOLD) != 0u) {
        (void)machine_hold(machine);
    }
    if ((set & 1u << COMMAND_STOP) != 0u) {
        (void)machine_request_stop(machine);
    }
    if ((set & 1u << COMMAND_QUICK_STOP) != 0u) {
        (void)machine_quick_stop(machine);
    }
}

enum machine_refusal commands_execute(struct controller *controller, enum command command)
{
    return commands_start(controller, command, START_ANY, 0);
}

enum machine_refusal commands_start(struct controller *controller, enum command command,
                                    enum start_name name, uint32_t number)
{
    controller->refusal = execute(controller, command, name, number);
    return controller->refusal;
}
