/* SPDX-License-Identifier: MIT */
#include <stdlib.h>

#include "node/drive_node_private.h"

/* A tripped overload lets itself be reset when it has cooled down to this. */
static const double overload_cool = 0.8;

void drive_node_inputs(struct drive_node *node)
{
    node->values.digital_inputs =
        equipment_inputs(&node->equipment, axis_motion_place_mm(&node->axis)) | node->forced_inputs;
}

bool drive_node_against_switch(const struct drive_node *node, int64_t change_counts)
{
    const uint32_t inputs = node->values.digital_inputs;
    return (change_counts < 0 && (inputs & EQUIPMENT_INPUT_NEGATIVE) != 0) ||
           (change_counts > 0 && (inputs & EQUIPMENT_INPUT_POSITIVE) != 0);
}

bool drive_node_cause_persists(const struct drive_node *node)
{
    return node->encoder_failed || node->supply_failed ||
           overload_above(&node->overload, overload_cool);
}

static void drive_node_watch_following(struct drive_node *node)
{
    const struct od_drive *v = &node->values;
    if (v->following_error_window == UINT32_MAX) {
        return;
    }
    const int64_t error = (int64_t)node->axis.target_counts - axis_motion_position(&node->axis);
    if (llabs(error) <= (int64_t)v->following_error_window) {
        node->following_us = 0;
        return;
    }
    node->following_us += node->axis.config.period_us;
    if (node->following_us > 1000u * (uint32_t)v->following_error_time_out) {
        drive_node_fail(node, EMCY_FOLLOWING_ERROR);
    }
}

static void drive_node_watch_overload(struct drive_node *node)
{
    if (node->overload.level_s <= 0.0) {
        return;
    }
    overload_step(&node->overload, node->axis.drive.state.volts * node->load_per_volt,
                  (double)node->axis.config.period_us * 1e-6);
    const bool overloaded = overload_above(&node->overload, 1.0);
    if (overloaded && !node->overloaded) {
        drive_node_fail_powerless(node, EMCY_OVERLOAD);
    }
    node->overloaded = overloaded;
}

void drive_node_watch(struct drive_node *node)
{
    const enum cia402_action action = cia402_device_action(&node->device);
    drive_node_inputs(node);
    drive_node_watch_overload(node);
    if (action == CIA402_FOLLOW || action == CIA402_SLOW_DOWN || action == CIA402_STOP_QUICKLY) {
        drive_node_watch_following(node);
    }
}
