/* SPDX-License-Identifier: MIT */
#include "node/node_fault.h"

#include "node/drive_node_private.h"

static int node_fault_stop(struct drive_node *node, bool on)
{
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
    node->axis.drive.pdff.volts_limit = on && volts < own ? volts : own;
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
    case NODE_FAULT_SATURATE:
        return node_fault_saturate(node, value, on);
    case NODE_FAULT_CODE:
        return node_fault_code(node, value, on);
    default:
        return NODE_FAULT_ERR_VALUE;
    }
}
