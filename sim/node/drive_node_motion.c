/* SPDX-License-Identifier: MIT */
#include "node/drive_node_private.h"

/* A drive that is switched on by hand, without a setpoint, stays where it is. */
static void drive_node_enabled(struct drive_node *node)
{
    node->values.simulation.reproducible = 1;
    node->values.error_code = EMCY_NO_ERROR;
    emcy_producer_clear(&node->emcy, EMCY_REGISTER_COMMUNICATION);
    if (!node->setpoint_fresh) {
        node->values.target_position = node->axis.target_counts;
    }
}

void drive_node_control(struct drive_node *node, uint16_t controlword)
{
    node->values.controlword = controlword;
    node->device.options.quick_stop = node->values.quick_stop_option_code;
    node->device.options.fault_reaction = node->values.fault_reaction_option_code;
    const bool changed = cia402_device_control(&node->device, controlword);
    if (changed && cia402_device_action(&node->device) == CIA402_FOLLOW) {
        drive_node_enabled(node);
    }
}

/* The setpoint within the software limits 0x607D; bit 11 of the statusword says when they bind. */
static int32_t drive_node_target(struct drive_node *node)
{
    const int32_t asked = node->values.target_position;
    const int32_t low = node->values.software_position_limit[0];
    const int32_t high = node->values.software_position_limit[1];
    const int32_t target = asked < low ? low : (asked > high ? high : asked);
    if (target != asked) {
        node->device.flags |= CIA402_STATUS_LIMIT;
    } else {
        node->device.flags &= (uint16_t)~CIA402_STATUS_LIMIT;
    }
    return target;
}

void drive_node_step(struct drive_node *node)
{
    switch (cia402_device_action(&node->device)) {
    case CIA402_FOLLOW:
        axis_motion_follow(&node->axis, drive_node_target(node));
        break;
    case CIA402_STOP_QUICKLY:
    case CIA402_STOP_FOR_FAULT:
        if (axis_motion_stop(&node->axis, node->values.quick_stop_deceleration)) {
            (void)cia402_device_stopped(&node->device);
        }
        break;
    default:
        axis_motion_hold(&node->axis);
        break;
    }
    node->setpoint_fresh = false;
    node->values.simulation.periods++;
}

void drive_node_stop_for(struct drive_node *node, uint16_t code)
{
    if (cia402_device_action(&node->device) != CIA402_FOLLOW) {
        return;
    }
    node->values.error_code = code;
    node->values.simulation.reproducible = 0;
    emcy_producer_raise(&node->emcy, code, EMCY_REGISTER_COMMUNICATION, NULL);
    (void)cia402_device_quick_stop(&node->device);
}

/* Bits of 0x1001 for an error code, by its class (CiA 301 table 26). */
static uint8_t drive_node_register_bits(uint16_t code)
{
    switch (code >> 12) {
    case 2:
        return EMCY_REGISTER_CURRENT;
    case 3:
        return EMCY_REGISTER_VOLTAGE;
    case 4:
        return EMCY_REGISTER_TEMPERATURE;
    case 8:
        return (code & 0xFF00u) <= 0x8200u ? EMCY_REGISTER_COMMUNICATION : EMCY_REGISTER_PROFILE;
    case 15:
        return EMCY_REGISTER_MANUFACTURER;
    default:
        return EMCY_REGISTER_GENERIC;
    }
}

void drive_node_fail(struct drive_node *node, uint16_t code)
{
    if (cia402_device_fault(&node->device)) {
        node->values.error_code = code;
        emcy_producer_raise(&node->emcy, code, drive_node_register_bits(code), NULL);
    }
}
