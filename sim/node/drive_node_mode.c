/* SPDX-License-Identifier: MIT */
#include "node/drive_node_private.h"

/* Another mode takes over an axis at rest only: neither on its way by setpoints nor homing. */
bool drive_node_mode_may_change(const struct drive_node *node)
{
    switch (cia402_device_action(&node->device)) {
    case CIA402_POWER_OFF:
    case CIA402_HOLD:
        return true;
    case CIA402_FOLLOW:
        return node->axis.speed_counts_period == 0 && !drive_node_homing_busy(node);
    default:
        return false;
    }
}

void drive_node_mode_take(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    const int8_t asked = v->modes_of_operation;
    if (asked == v->modes_of_operation_display ||
        (asked != CIA402_MODE_CSP && asked != CIA402_MODE_HOMING) ||
        !drive_node_mode_may_change(node)) {
        return;
    }
    drive_node_homing_leave(node);
    v->modes_of_operation_display = asked;
    if (!node->setpoint_fresh) {
        v->target_position = node->axis.target_counts;
    }
}

/* CiA 402-2, homing: bit 12 attained, 13 error, 10 at rest. */
static uint16_t drive_node_homing_flags(const struct drive_node *node)
{
    const uint16_t reached = node->axis.speed_counts_period == 0 ? CIA402_STATUS_TARGET_REACHED : 0;
    switch (node->homing.phase) {
    case HOME_SEEK_IDLE:
        return node->homed ? reached | CIA402_STATUS_FOLLOWS : reached;
    case HOME_SEEK_DONE:
        return CIA402_STATUS_FOLLOWS | CIA402_STATUS_TARGET_REACHED;
    case HOME_SEEK_FAILED:
        return CIA402_STATUS_FOLLOWING_ERROR | reached;
    default:
        return 0;
    }
}

/* CSP: bit 12 follows the command value, 13 following error. */
static uint16_t drive_node_csp_flags(const struct drive_node *node)
{
    const bool follows = cia402_device_action(&node->device) == CIA402_FOLLOW &&
                         !node->software_limit && !node->limit_switch_hit;
    const bool error = node->values.error_code == EMCY_FOLLOWING_ERROR;
    return (uint16_t)((follows ? CIA402_STATUS_FOLLOWS : 0u) |
                      (error ? CIA402_STATUS_FOLLOWING_ERROR : 0u));
}

static bool drive_node_limited(const struct drive_node *node)
{
    const double volts = node->axis.drive.state.volts;
    const double limit = node->axis.influence.volts_limit;
    return node->software_limit || node->limit_switch_hit || volts >= limit || volts <= -limit;
}

uint16_t drive_node_mode_flags(const struct drive_node *node)
{
    const uint16_t mode = node->values.modes_of_operation_display == CIA402_MODE_HOMING
                              ? drive_node_homing_flags(node)
                              : drive_node_csp_flags(node);
    return (uint16_t)(mode | (drive_node_limited(node) ? CIA402_STATUS_LIMIT : 0u));
}
