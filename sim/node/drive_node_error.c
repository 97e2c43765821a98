/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "node/drive_node_private.h"

enum { ABORT_NOTHING, ABORT_FAULT, ABORT_VOLTAGE_OFF, ABORT_QUICK_STOP }; /* 0x6007 */

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
    case 7:
        return EMCY_REGISTER_PROFILE;
    case 8:
        return code < 0x8300u || code == EMCY_SYNC_LOST ? EMCY_REGISTER_COMMUNICATION
                                                        : EMCY_REGISTER_PROFILE;
    case 15:
        return EMCY_REGISTER_MANUFACTURER;
    default:
        return EMCY_REGISTER_GENERIC;
    }
}

static void drive_node_tell(struct drive_node *node, uint16_t code, uint8_t detail)
{
    const uint8_t details[EMCY_DETAIL_SIZE] = {detail, 0, 0, 0, 0};
    node->values.error_code = code;
    emcy_producer_raise(&node->emcy, code, drive_node_register_bits(code), details);
}

void drive_node_fail(struct drive_node *node, uint16_t code)
{
    if (cia402_device_fault(&node->device)) {
        drive_node_no_stop(node);
        drive_node_tell(node, code, 0);
    }
}

/* Without encoder or supply there is nothing to stop with: the brake has to do it. In a fault already it is one more
 * error, which the master shall know of too. */
void drive_node_fail_powerless(struct drive_node *node, uint16_t code)
{
    const int16_t reaction = node->device.options.fault_reaction;
    node->device.options.fault_reaction = 0;
    if (node->device.state == CIA402_FAULT_REACTION_ACTIVE) {
        (void)cia402_device_stopped(&node->device);
    }
    if (cia402_device_fault(&node->device)) {
        drive_node_no_stop(node);
    }
    drive_node_tell(node, code, 0);
    node->device.options.fault_reaction = reaction;
}

static bool drive_node_enabled_now(const struct drive_node *node)
{
    return node->device.state == CIA402_OPERATION_ENABLED;
}

void drive_node_disconnect(struct drive_node *node, uint16_t code)
{
    if (!drive_node_enabled_now(node)) {
        return;
    }
    node->values.simulation.reproducible = 0;
    switch (node->values.abort_connection_option_code) {
    case ABORT_NOTHING:
        drive_node_tell(node, code, 0);
        break;
    case ABORT_FAULT:
        drive_node_fail(node, code);
        break;
    case ABORT_VOLTAGE_OFF:
        drive_node_tell(node, code, 0);
        (void)cia402_device_power_off(&node->device);
        break;
    default:
        drive_node_quick_stop(node, code, 0);
        break;
    }
}

void drive_node_quick_stop(struct drive_node *node, uint16_t code, uint8_t detail)
{
    if (drive_node_enabled_now(node)) {
        drive_node_no_stop(node);
        drive_node_tell(node, code, detail);
        (void)cia402_device_quick_stop(&node->device);
    }
}

void drive_node_forgive(struct drive_node *node)
{
    node->values.error_code = EMCY_NO_ERROR;
    node->following_us = 0;
    node->limit_switch_hit = false;
    node->rpdos_short = 0;
    emcy_producer_clear(&node->emcy, 0xFF);
}
