/* SPDX-License-Identifier: MIT */
/* axis_motion: the simulated axis of a drive node: follows setpoints, stands braked, or stops by a
 * ramp of its own.
 *
 * One call a bus period. All in one context.
 */
#ifndef NODE_AXIS_MOTION_H
#define NODE_AXIS_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"

struct axis_motion {
    struct drive_config config;
    struct drive drive;
    int32_t target_counts;       /* of the last period */
    int64_t speed_counts_period; /* change of the target in the last period */
};

/* Parked at a position. Returns 0 or an enum drive_error; then nothing else may be called. */
int axis_motion_init(struct axis_motion *axis, const struct drive_config *config,
                     int32_t position_counts);

/* Another bus period, while the axis stands. Returns 0, or an enum drive_error and nothing changes.
 */
int axis_motion_set_period(struct axis_motion *axis, uint32_t period_us);

/* One period towards a target. */
void axis_motion_follow(struct axis_motion *axis, int32_t target_counts);

/* One period with the brake on: at rest where it is. */
void axis_motion_hold(struct axis_motion *axis);

/* One period of a stop: the target's speed falls by the deceleration (counts/s^2). Returns true
 * when the target stands still. */
bool axis_motion_stop(struct axis_motion *axis, uint32_t deceleration_counts_s2);

#endif
