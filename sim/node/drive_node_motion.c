/* SPDX-License-Identifier: MIT */
#include "node/drive_node_private.h"

#define CONTROL_HOMING_START 0x0010u

/* The beginning of Operation enabled. A drive that is switched on by hand, without a setpoint, stays
 * where it is. */
static void drive_node_enabled(struct drive_node *node)
{
    node->values.simulation.reproducible = 1;
    node->silence_us = 0;
    node->sync_lost = false;
    drive_node_forgive(node);
    drive_node_no_stop(node);
    if (!node->setpoint_fresh) {
        node->values.target_position = node->axis.target_counts;
    }
}

static void drive_node_take_options(struct drive_node *node)
{
    struct cia402_options *options = &node->device.options;
    options->quick_stop = node->values.quick_stop_option_code;
    options->fault_reaction = node->values.fault_reaction_option_code;
    options->shutdown = node->values.shutdown_option_code;
    options->disable = node->values.disable_operation_option_code;
}

void drive_node_control(struct drive_node *node, uint16_t controlword)
{
    const bool was_fault = node->device.state == CIA402_FAULT;
    const bool was_enabled = node->device.state == CIA402_OPERATION_ENABLED;
    node->values.controlword = controlword;
    drive_node_take_options(node);
    node->device.fault_persists = was_fault && drive_node_cause_persists(node);
    const bool changed = cia402_device_control(&node->device, controlword);
    if (changed && was_fault) {
        drive_node_forgive(node);
    }
    if (changed && !was_enabled && cia402_device_action(&node->device) == CIA402_FOLLOW) {
        drive_node_enabled(node);
    }
    drive_node_homing_control(node, (controlword & CONTROL_HOMING_START) != 0);
}

/* The setpoint within the software limits 0x607D. */
static int32_t drive_node_target(struct drive_node *node)
{
    const int32_t asked = node->values.target_position;
    const int32_t low = node->values.software_position_limit[0];
    const int32_t high = node->values.software_position_limit[1];
    const int32_t target = asked < low ? low : (asked > high ? high : asked);
    node->software_limit = target != asked;
    return target;
}

/* Velocity and torque offset 0x60B1, 0x60B2 of this period. */
static void drive_node_offsets(struct drive_node *node, bool on)
{
    const int32_t speed = on ? node->values.velocity_offset : 0;
    const int16_t torque = on ? node->values.torque_offset : 0;
    const bool act = speed != 0 || torque != 0;
    if (act || node->offsets_act) {
        axis_motion_offsets(&node->axis, speed, torque);
    }
    node->offsets_act = act;
}

/* Returns false when the setpoint leads further onto a limit switch: nothing has moved yet. */
static bool drive_node_follow(struct drive_node *node)
{
    const int32_t target = drive_node_target(node);
    if (drive_node_against_switch(node, (int64_t)target - node->axis.target_counts)) {
        node->limit_switch_hit = true;
        drive_node_quick_stop(node, EMCY_POSITION_LIMIT, target < node->axis.target_counts ? 1 : 2);
        return false;
    }
    drive_node_offsets(node, true);
    axis_motion_follow(&node->axis, target);
    return true;
}

static void drive_node_move(struct drive_node *node)
{
    const struct od_drive *v = &node->values;
    const enum cia402_action action = cia402_device_action(&node->device);
    if (action == CIA402_FOLLOW && v->modes_of_operation_display != CIA402_MODE_HOMING) {
        if (drive_node_follow(node)) {
            return;
        }
        drive_node_move(node);
        return;
    }
    drive_node_offsets(node, false);
    switch (action) {
    case CIA402_FOLLOW:
        drive_node_homing_step(node);
        break;
    case CIA402_SLOW_DOWN:
        drive_node_stop(node, v->profile_deceleration);
        break;
    case CIA402_STOP_QUICKLY:
        drive_node_stop_as(node, v->quick_stop_option_code);
        break;
    case CIA402_STOP_FOR_FAULT:
        drive_node_stop_as(node, v->fault_reaction_option_code);
        break;
    default:
        drive_node_no_stop(node);
        (void)axis_motion_hold(&node->axis);
        break;
    }
}

void drive_node_step(struct drive_node *node)
{
    drive_node_mode_take(node);
    drive_node_move(node);
    drive_node_watch(node);
    node->setpoint_fresh = false;
    node->values.simulation.periods++;
}
