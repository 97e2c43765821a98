/* SPDX-License-Identifier: MIT */
/* The transitions that a controlword asks for. */
#include "canopen/cia402_device.h"

#include "canopen/cia402_device_private.h"

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
    case COMMAND_ENABLE_OPERATION: /* by way of Switched on */
        return cia402_device_enter(device, CIA402_SWITCHED_ON);
    case COMMAND_SHUTDOWN:
        return false;
    default:
        return cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

static bool control_switched_on(struct cia402_device *device, enum command command)
{
    switch (command) {
    case COMMAND_ENABLE_OPERATION:
        return cia402_device_enter(device, CIA402_OPERATION_ENABLED);
    case COMMAND_SWITCH_ON:
        return false;
    case COMMAND_SHUTDOWN:
        return cia402_device_enter(device, CIA402_READY_TO_SWITCH_ON);
    default:
        return cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

/* Out of Operation enabled, at once or after a stop. */
static bool leave(struct cia402_device *device, enum cia402_state to, int16_t option)
{
    if (option == 0) {
        return cia402_device_enter(device, to);
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
        return cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
    }
}

static bool control_quick_stop(struct cia402_device *device, enum command command)
{
    if (command == COMMAND_DISABLE_VOLTAGE) {
        return cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
    }
    return command == COMMAND_ENABLE_OPERATION &&
           device->options.quick_stop >= CIA402_QUICK_STOP_STAYS &&
           cia402_device_enter(device, CIA402_OPERATION_ENABLED);
}

bool cia402_device_control(struct cia402_device *device, uint16_t controlword)
{
    uint16_t rising = (uint16_t)(controlword & (uint16_t)~device->controlword);
    enum command command = command_of(controlword);

    device->controlword = controlword;
    switch (device->state) {
    case CIA402_SWITCH_ON_DISABLED:
        return command == COMMAND_SHUTDOWN &&
               cia402_device_enter(device, CIA402_READY_TO_SWITCH_ON);
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
               cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
    default:
        return false;
    }
}
