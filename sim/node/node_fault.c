/* SPDX-License-Identifier: MIT */
#include "node/node_fault.h"

#include "node/drive_node_private.h"

/* The supply has failed when less than this part of the drive's own voltage is left. */
static const double undervoltage = 0.1;

static int node_fault_stop(struct drive_node *node, bool on)
{
    if (on && !node->silent) {
        cia402_device_init(&node->device);
        node->own_us = 0;
    }
    if (node->silent && !on) {
        drive_node_power_on(node);
    }
    node->silent = on;
    return 0;
}

static int node_fault_saturate(struct drive_node *node, double volts, bool on)
{
    const double own = node->axis.config.plant.volts_limit;
    if (on && !(volts > 0.0)) {
        return NODE_FAULT_ERR_VALUE;
    }
    node->axis.influence.volts_limit = on && volts < own ? volts : own;
    node->supply_failed = on && volts < undervoltage * own;
    if (node->supply_failed) {
        drive_node_fail_powerless(node, EMCY_DC_UNDERVOLTAGE);
    }
    return 0;
}

static int node_fault_code(struct drive_node *node, double code, bool on)
{
    if (!(code >= 1.0 && code <= 65535.0)) {
        return NODE_FAULT_ERR_VALUE;
    }
    if (on) {
        drive_node_fail(node, (uint16_t)code);
    }
    return 0;
}

static int node_fault_freeze(struct drive_node *node, bool on)
{
    struct influence *influence = &node->axis.influence;
    influence->encoder_frozen_mm = influence_read_mm(influence, &node->axis.drive);
    influence->encoder_frozen = on;
    return 0;
}

static int node_fault_jump(struct drive_node *node, double counts, bool on)
{
    const double jump_mm = on ? counts * node->axis.drive.mm_per_count : 0.0;
    if (on && !(counts >= -2147483648.0 && counts <= 2147483647.0)) {
        return NODE_FAULT_ERR_VALUE;
    }
    node->axis.influence.encoder_offset_mm += jump_mm - node->jump_mm;
    node->jump_mm = jump_mm;
    return 0;
}

static int node_fault_encoder(struct drive_node *node, bool on)
{
    node->encoder_failed = on;
    if (on) {
        drive_node_fail_powerless(node, EMCY_POSITION_SENSOR_1);
    }
    return 0;
}

static int node_fault_load(struct drive_node *node, double volts, bool on)
{
    if (on && !(volts >= -1000.0 && volts <= 1000.0)) {
        return NODE_FAULT_ERR_VALUE;
    }
    node->axis.influence.load_volts = on ? volts : 0.0;
    return 0;
}

static int node_fault_limit(struct drive_node *node, double side, bool on)
{
    if (side == 0.0) {
        return NODE_FAULT_ERR_VALUE;
    }
    const uint32_t input = side < 0.0 ? EQUIPMENT_INPUT_NEGATIVE : EQUIPMENT_INPUT_POSITIVE;
    node->forced_inputs = on ? node->forced_inputs | input : node->forced_inputs & ~input;
    drive_node_inputs(node);
    return 0;
}

int drive_node_fault(struct drive_node *node, enum node_fault kind, double value, bool on)
{
    switch (kind) {
    case NODE_FAULT_STOP:
        return node_fault_stop(node, on);
    case NODE_FAULT_RESTART:
        if (on) {
            drive_node_power_on(node);
        }
        return 0;
    case NODE_FAULT_HEARTBEAT_STOP:
        node->no_heartbeat = on;
        return 0;
    case NODE_FAULT_ENCODER_FREEZE:
        return node_fault_freeze(node, on);
    case NODE_FAULT_ENCODER_JUMP:
        return node_fault_jump(node, value, on);
    case NODE_FAULT_ENCODER_FAULT:
        return node_fault_encoder(node, on);
    case NODE_FAULT_SATURATE:
        return node_fault_saturate(node, value, on);
    case NODE_FAULT_LOAD:
        return node_fault_load(node, value, on);
    case NODE_FAULT_LIMIT_SWITCH:
        return node_fault_limit(node, value, on);
    case NODE_FAULT_CODE:
        return node_fault_code(node, value, on);
    default:
        return NODE_FAULT_ERR_VALUE;
    }
}
