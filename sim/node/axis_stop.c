/* SPDX-License-Identifier: MIT */
/* Implements node/axis_stop.h (see there): how a simulated drive stops its axis. Used by node/servo. One call in each
 * period; all in one context. Changes its struct and the axis that it is given; no I/O. */
#include "node/axis_stop.h"

#define WAIT_MAX_US 1000000u /* longest wait for the target position */

/* 0x605A and 0x605E: what the codes from 1 on mean, those above STAY for 0x605A only. */
enum { SLOW = 1, CURRENT_LIMIT = 3, VOLTAGE_LIMIT = 4, STAY = 4 };

void axis_stop_reset(struct axis_stop *stop)
{
    *stop = (struct axis_stop){.braked = false};
}

bool axis_stop_ramp(struct axis_stop *stop, struct axis_motion *axis, const struct od_drive *values,
                    uint32_t deceleration_counts_s2)
{
    const uint32_t period_us = axis->config.period_us;
    if (!axis_motion_ramp(axis, 0, deceleration_counts_s2)) {
        return false;
    }
    const bool settled = axis_motion_settled(axis, values->position_window);
    stop->settled_us = settled ? stop->settled_us + period_us : 0;
    stop->waited_us += period_us;
    if (stop->settled_us > 1000u * (uint32_t)values->position_window_time ||
        stop->waited_us > WAIT_MAX_US) {
        stop->waited_us = 0;
        return true;
    }
    return false;
}

bool axis_stop_by_option(struct axis_stop *stop, struct axis_motion *axis,
                         const struct od_drive *values, int16_t option_code)
{
    const int16_t how = option_code > STAY ? (int16_t)(option_code - STAY) : option_code;
    if (!stop->braked && (how == CURRENT_LIMIT || how == VOLTAGE_LIMIT)) {
        stop->braked = axis_motion_brake(axis, how == CURRENT_LIMIT ? AXIS_MOTION_CURRENT
                                                                    : AXIS_MOTION_VOLTAGE);
        return false;
    }
    return axis_stop_ramp(stop, axis, values,
                          how == SLOW ? values->profile_deceleration
                                      : values->quick_stop_deceleration);
}
