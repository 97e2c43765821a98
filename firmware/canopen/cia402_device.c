/* SPDX-License-Identifier: MIT */
/* Implements canopen/cia402_device.h (see there): the drive's side of the CiA 402 state machine. Used by the simulated
 * drives (sim/node/servo). All in one context. Changes only the device; no I/O. */
#include "canopen/cia402_device.h"

/* The option codes 0x605A from which on the drive stays in Quick stop active. */
#define QUICK_STOP_STAYS 5

void cia402_device_init(struct cia402_device *device)
{
    device->state = CIA402_NOT_READY;
    device->options.quick_stop = 2;
    device->options.fault_reaction = 2;
    device->options.shutdown = 0;
    device->options.disable = 0;
    device->controlword = 0;
    device->flags = CIA402_STATUS_REMOTE;
    device->stopped = false;
    device->leaving = false;
    device->leaving_to = CIA402_NOT_READY;
    device->fault_persists = false;
}

/* Enters a state; the flags of a stop belong to the previous state and are cleared. True when the state changed. */
static bool enter(struct cia402_device *device, enum cia402_state state)
{
    bool changed = device->state != state;

    device->state = state;
    device->stopped = device->stopped && !changed;
    device->leaving = device->leaving && !changed;
    return changed;
}

bool cia402_device_ready(struct cia402_device *device)
{
    return device->state == CIA402_NOT_READY && enter(device, CIA402_SWITCH_ON_DISABLED);
}

bool cia402_device_quick_stop(struct cia402_device *device)
{
    if (device->state != CIA402_OPERATION_ENABLED) {
        return false;
    }
    return enter(device, device->options.quick_stop == 0 ? CIA402_SWITCH_ON_DISABLED
                                                         : CIA402_QUICK_STOP_ACTIVE);
}

bool cia402_device_fault(struct cia402_device *device)
{
    bool moving =
        device->state == CIA402_OPERATION_ENABLED || device->state == CIA402_QUICK_STOP_ACTIVE;

    if (device->state == CIA402_FAULT || device->state == CIA402_FAULT_REACTION_ACTIVE) {
        return false;
    }
    return enter(device, moving && device->options.fault_reaction != 0
                             ? CIA402_FAULT_REACTION_ACTIVE
                             : CIA402_FAULT);
}

bool cia402_device_stopped(struct cia402_device *device)
{
    if (device->state == CIA402_FAULT_REACTION_ACTIVE) {
        return enter(device, CIA402_FAULT);
    }
    if (device->leaving) {
        return enter(device, device->leaving_to);
    }
    if (device->state != CIA402_QUICK_STOP_ACTIVE) {
        return false;
    }
    device->stopped = true;
    return device->options.quick_stop < QUICK_STOP_STAYS &&
           enter(device, CIA402_SWITCH_ON_DISABLED);
}

bool cia402_device_power_off(struct cia402_device *device)
{
    switch (device->state) {
    case CIA402_READY_TO_SWITCH_ON:
    case CIA402_SWITCHED_ON:
    case CIA402_OPERATION_ENABLED:
    case CIA402_QUICK_STOP_ACTIVE:
        return enter(device, CIA402_SWITCH_ON_DISABLED);
    default:
        return false;
    }
}

enum cia402_action cia402_device_action(const struct cia402_device *device)
{
    switch (device->state) {
    case CIA402_SWITCHED_ON:
        return CIA402_HOLD;
    case CIA402_OPERATION_ENABLED:
        return device->leaving ? CIA402_SLOW_DOWN : CIA402_FOLLOW;
    case CIA402_QUICK_STOP_ACTIVE:
        return CIA402_STOP_QUICKLY;
    case CIA402_FAULT_REACTION_ACTIVE:
        return CIA402_STOP_FOR_FAULT;
    default:
        return CIA402_POWER_OFF;
    }
}

uint16_t cia402_device_statusword(const struct cia402_device *device)
{
    uint16_t flags = device->flags;

    if (device->state != CIA402_OPERATION_ENABLED) {
        flags = (uint16_t)(flags & (uint16_t)~CIA402_STATUS_FOLLOWS);
    }
    if (device->stopped) {
        flags |= CIA402_STATUS_TARGET_REACHED;
    }
    return (uint16_t)(flags | cia402_status_bits(device->state));
}

/* Commands to the state machine, decoded from a controlword. */
enum command {
    COMMAND_DISABLE_VOLTAGE,
    COMMAND_QUICK_STOP,
    COMMAND_SHUTDOWN,
    COMMAND_SWITCH_ON, /* in Operation enabled: disable operation */
    COMMAND_ENABLE_OPERATION
};

static enum command command_of(uint16_t controlword)
{
    if ((controlword & CIA402_CONTROL_VOLTAGE) == 0) {
        return COMMAND_DISABLE_VOLTAGE;
    }
    if ((controlword & CIA402_CONTROL_QUICK_STOP) == 0) {
        return COMMAND_QUICK_STOP;
    }
    if ((controlword & CIA402_CONTROL_SWITCH_ON) == 0) {
        return COMMAND_SHUTDOWN;
    }
    return (controlword & CIA402_CONTROL_ENABLE) == 0 ? COMMAND_SWITCH_ON
                                                      : COMMAND_ENABLE_OPERATION;
}

static bool control_ready(struct cia402_device *device, enum command command)
{
    switch (command) {
    case COMMAND_SWITCH_ON:
    case COMMAND_ENABLE_OPERATION: /* first to Switched on */
        return enter(device, CIA402_SWITCHED_ON);
    case COMMAND_SHUTDOWN:
        return false;
    default:
        return enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

static bool control_switched_on(struct cia402_device *device, enum command command)
{
    switch (command) {
    case COMMAND_ENABLE_OPERATION:
        return enter(device, CIA402_OPERATION_ENABLED);
    case COMMAND_SWITCH_ON:
        return false;
    case COMMAND_SHUTDOWN:
        return enter(device, CIA402_READY_TO_SWITCH_ON);
    default:
        return enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

/* Out of Operation enabled, at once or after a stop. */
static bool leave(struct cia402_device *device, enum cia402_state to, int16_t option)
{
    if (option == 0) {
        return enter(device, to);
    }
    device->leaving = true;
    device->leaving_to = to;
    return false;
}

static bool control_enabled(struct cia402_device *device, enum command command)
{
    switch (command) {
    case COMMAND_ENABLE_OPERATION:
        device->leaving = false;
        return false;
    case COMMAND_SWITCH_ON:
        return leave(device, CIA402_SWITCHED_ON, device->options.disable);
    case COMMAND_SHUTDOWN:
        return leave(device, CIA402_READY_TO_SWITCH_ON, device->options.shutdown);
    case COMMAND_QUICK_STOP:
        return cia402_device_quick_stop(device);
    default:
        return enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

static bool control_quick_stop(struct cia402_device *device, enum command command)
{
    if (command == COMMAND_DISABLE_VOLTAGE) {
        return enter(device, CIA402_SWITCH_ON_DISABLED);
    }
    return command == COMMAND_ENABLE_OPERATION && device->options.quick_stop >= QUICK_STOP_STAYS &&
           enter(device, CIA402_OPERATION_ENABLED);
}

bool cia402_device_control(struct cia402_device *device, uint16_t controlword)
{
    uint16_t rising = (uint16_t)(controlword & (uint16_t)~device->controlword);
    enum command command = command_of(controlword);

    device->controlword = controlword;
    switch (device->state) {
    case CIA402_SWITCH_ON_DISABLED:
        return command == COMMAND_SHUTDOWN && enter(device, CIA402_READY_TO_SWITCH_ON);
    case CIA402_READY_TO_SWITCH_ON:
        return control_ready(device, command);
    case CIA402_SWITCHED_ON:
        return control_switched_on(device, command);
    case CIA402_OPERATION_ENABLED:
        return control_enabled(device, command);
    case CIA402_QUICK_STOP_ACTIVE:
        return control_quick_stop(device, command);
    case CIA402_FAULT:
        return (rising & CIA402_CONTROL_FAULT_RESET) != 0 && !device->fault_persists &&
               enter(device, CIA402_SWITCH_ON_DISABLED);
    default:
        return false;
    }
}
