/* SPDX-License-Identifier: MIT */
#include "node/axis_motion.h"

static void axis_motion_rest(struct axis_motion *axis)
{
    axis->target_counts = drive_position_counts(&axis->drive);
    axis->speed_counts_period = 0;
}

int axis_motion_init(struct axis_motion *axis, const struct drive_config *config,
                     int32_t position_counts)
{
    const int error = drive_init(&axis->drive, config);
    if (error != 0) {
        return error;
    }
    axis->config = *config;
    drive_place(&axis->drive, position_counts);
    axis_motion_rest(axis);
    return 0;
}

int axis_motion_set_period(struct axis_motion *axis, uint32_t period_us)
{
    struct drive changed;
    struct drive_config config = axis->config;
    config.period_us = period_us;
    const int error = drive_init(&changed, &config);
    if (error != 0) {
        return error;
    }
    drive_place(&changed, drive_position_counts(&axis->drive));
    axis->config = config;
    axis->drive = changed;
    axis_motion_rest(axis);
    return 0;
}

void axis_motion_follow(struct axis_motion *axis, int32_t target_counts)
{
    drive_period(&axis->drive, target_counts);
    axis->speed_counts_period = (int64_t)target_counts - axis->target_counts;
    axis->target_counts = target_counts;
}

void axis_motion_hold(struct axis_motion *axis)
{
    drive_hold(&axis->drive);
    axis_motion_rest(axis);
}

/* Change of speed in one period, counts per period: at least one, so that every stop ends. */
static int64_t axis_motion_slower(const struct axis_motion *axis, uint32_t deceleration_counts_s2)
{
    const double period_s = (double)axis->config.period_us * 1e-6;
    const double change = (double)deceleration_counts_s2 * period_s * period_s;
    return change > 1.0 ? (int64_t)change : 1;
}

bool axis_motion_stop(struct axis_motion *axis, uint32_t deceleration_counts_s2)
{
    const int64_t change = axis_motion_slower(axis, deceleration_counts_s2);
    int64_t speed = axis->speed_counts_period;
    if (speed > change) {
        speed -= change;
    } else if (speed < -change) {
        speed += change;
    } else {
        speed = 0;
    }
    int64_t target = axis->target_counts + speed;
    target = target > INT32_MAX ? INT32_MAX : (target < INT32_MIN ? INT32_MIN : target);
    axis_motion_follow(axis, (int32_t)target);
    return speed == 0;
}
