/* SPDX-License-Identifier: MIT */
#include "canopen/cia402_device.h"

#include "canopen/cia402_device_private.h"

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

bool cia402_device_enter(struct cia402_device *device, enum cia402_state state)
{
    bool changed = device->state != state;

    device->state = state;
    device->stopped = device->stopped && !changed;
    device->leaving = device->leaving && !changed;
    return changed;
}

bool cia402_device_ready(struct cia402_device *device)
{
    return device->state == CIA402_NOT_READY &&
           cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
}

bool cia402_device_quick_stop(struct cia402_device *device)
{
    if (device->state != CIA402_OPERATION_ENABLED) {
        return false;
    }
    return cia402_device_enter(device, device->options.quick_stop == 0 ? CIA402_SWITCH_ON_DISABLED
                                                                       : CIA402_QUICK_STOP_ACTIVE);
}

bool cia402_device_fault(struct cia402_device *device)
{
    bool moving =
        device->state == CIA402_OPERATION_ENABLED || device->state == CIA402_QUICK_STOP_ACTIVE;

    if (device->state == CIA402_FAULT || device->state == CIA402_FAULT_REACTION_ACTIVE) {
        return false;
    }
    return cia402_device_enter(device, moving && device->options.fault_reaction != 0
                                           ? CIA402_FAULT_REACTION_ACTIVE
                                           : CIA402_FAULT);
}

bool cia402_device_stopped(struct cia402_device *device)
{
    if (device->state == CIA402_FAULT_REACTION_ACTIVE) {
        return cia402_device_enter(device, CIA402_FAULT);
    }
    if (device->leaving) {
        return cia402_device_enter(device, device->leaving_to);
    }
    if (device->state != CIA402_QUICK_STOP_ACTIVE) {
        return false;
    }
    device->stopped = true;
    return device->options.quick_stop < CIA402_QUICK_STOP_STAYS &&
           cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
}

bool cia402_device_power_off(struct cia402_device *device)
{
    switch (device->state) {
    case CIA402_READY_TO_SWITCH_ON:
    case CIA402_SWITCHED_ON:
    case CIA402_OPERATION_ENABLED:
    case CIA402_QUICK_STOP_ACTIVE:
        return cia402_device_enter(device, CIA402_SWITCH_ON_DISABLED);
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
