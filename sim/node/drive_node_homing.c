/* SPDX-License-Identifier: MIT */
#include "node/drive_node_private.h"

enum { FAST, SLOW }; /* 0x6099 subs 1, 2 */

bool drive_node_homing_busy(const struct drive_node *node)
{
    return node->homing.phase >= HOME_SEEK_SEARCH && node->homing.phase <= HOME_SEEK_STOP;
}

void drive_node_homing_leave(struct drive_node *node)
{
    node->homing.phase = HOME_SEEK_IDLE;
    node->homing_asked = false;
}

void drive_node_homing_control(struct drive_node *node, bool asked)
{
    const bool begins = asked && !node->homing_asked;
    if (node->values.modes_of_operation_display != CIA402_MODE_HOMING ||
        cia402_device_action(&node->device) != CIA402_FOLLOW) {
        if (drive_node_homing_busy(node)) {
            node->homing.phase = HOME_SEEK_IDLE;
        }
        node->homing_asked = false;
        return;
    }
    node->homing_asked = asked;
    if (begins) {
        node->homed = false;
        node->homing_edge = axis_motion_position(&node->axis);
        home_seek_begin(&node->homing, node->values.homing_method);
    } else if (!asked && drive_node_homing_busy(node)) {
        node->homing.phase = HOME_SEEK_IDLE;
    }
}

/* Wanted speed in counts a period. */
static int64_t drive_node_homing_speed(const struct drive_node *node)
{
    const int asked = home_seek_speed(&node->homing);
    const bool slow = asked == 1 || asked == -1;
    const int64_t counts_s = node->values.homing_speeds[slow ? SLOW : FAST];
    const int64_t speed = counts_s * node->axis.config.period_us / 1000000;
    if (asked == 0 || (node->values.controlword & CIA402_CONTROL_HALT) != 0) {
        return 0;
    }
    return (speed > 0 ? speed : 1) * (asked > 0 ? 1 : -1);
}

/* At rest after home was passed: the coordinates change places. */
static void drive_node_homing_finish(struct drive_node *node)
{
    axis_motion_shift(&node->axis, node->homing_edge, node->values.home_offset);
    node->values.target_position = node->axis.target_counts;
    node->homing.phase = HOME_SEEK_DONE;
    node->homed = true;
}

void drive_node_homing_step(struct drive_node *node)
{
    struct axis_motion *axis = &node->axis;
    const bool steady =
        axis_motion_ramp(axis, drive_node_homing_speed(node), node->values.homing_acceleration);
    drive_node_inputs(node);
    if (home_seek_look(&node->homing, node->values.digital_inputs) == HOME_SEEK_EDGE) {
        node->homing_edge = axis_motion_position(axis);
    }
    if (drive_node_homing_busy(node) &&
        (axis->target_counts == INT32_MAX || axis->target_counts == INT32_MIN)) {
        node->homing.phase = HOME_SEEK_FAILED;
    }
    if (node->homing.phase == HOME_SEEK_STOP && steady && drive_node_settled(node)) {
        drive_node_homing_finish(node);
    }
}
