/* SPDX-License-Identifier: MIT */
#include <stdlib.h>

#include "node/drive_node_private.h"

/* A motor that does not come to rest by then (a load, a lost encoder) is left to its brake. */
enum { PATIENCE_US = 1000000 };

bool drive_node_settled(const struct drive_node *node)
{
    const int64_t away = (int64_t)node->axis.target_counts - axis_motion_position(&node->axis);
    return llabs(away) <= (int64_t)node->values.position_window;
}

void drive_node_no_stop(struct drive_node *node)
{
    node->settled_us = 0;
    node->stopping_us = 0;
    node->braked = false;
}

/* The ramp is the reference's; the stop has ended when the motor, too, has stood in the position
 * window (0x6067) for its time (0x6068). */
void drive_node_stop(struct drive_node *node, uint32_t deceleration_counts_s2)
{
    const uint32_t period_us = node->axis.config.period_us;
    if (!axis_motion_ramp(&node->axis, 0, deceleration_counts_s2)) {
        return;
    }
    node->settled_us = drive_node_settled(node) ? node->settled_us + period_us : 0;
    node->stopping_us += period_us;
    if (node->settled_us > 1000u * (uint32_t)node->values.position_window_time ||
        node->stopping_us > PATIENCE_US) {
        node->stopping_us = 0;
        (void)cia402_device_stopped(&node->device);
    }
}

/* 0x605A and 0x605E: what the codes from 1 on mean, those from STAY on for 0x605A only. */
enum { SLOW = 1, CURRENT_LIMIT = 3, VOLTAGE_LIMIT = 4, STAY = 4 };

void drive_node_stop_as(struct drive_node *node, int16_t option)
{
    const struct od_drive *v = &node->values;
    const int16_t how = option > STAY ? (int16_t)(option - STAY) : option;
    if (!node->braked && (how == CURRENT_LIMIT || how == VOLTAGE_LIMIT)) {
        node->braked = axis_motion_brake(&node->axis, how == CURRENT_LIMIT ? AXIS_MOTION_CURRENT
                                                                           : AXIS_MOTION_VOLTAGE);
        return;
    }
    drive_node_stop(node, how == SLOW ? v->profile_deceleration : v->quick_stop_deceleration);
}
