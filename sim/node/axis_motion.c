/* SPDX-License-Identifier: MIT */
/* Implements node/axis_motion.h (see there): the simulated axis of a drive node. Used by sim/node only. Changes its
 * structs only; all in one context. */
#include "node/axis_motion.h"

#include <stdlib.h>

static void axis_motion_rest(struct axis_motion *axis)
{
    axis->target_counts = axis_motion_position(axis);
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
    axis->rated_torque_nm = drive_config_rated_torque_nm(config);
    axis->brake_volts = config->plant.volts_limit;
    axis->machine_mm = 0.0;
    influence_none(&axis->influence, config);
    drive_place(&axis->drive, position_counts);
    axis_motion_rest(axis);
    return 0;
}

static void axis_motion_put_scale(struct drive *drive, double counts_per_mm)
{
    drive->counts_per_mm = counts_per_mm;
    drive->mm_per_count = 1.0 / counts_per_mm;
}

/* The loop restarts; the motor keeps its place and speed. */
static void axis_motion_release(struct axis_motion *axis, struct motor_state motor)
{
    axis->drive.state.motor = motor;
    drive_hold(&axis->drive);
    axis->drive.state.motor = motor;
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
    const bool moves = !axis_motion_at_standstill(axis);
    const struct motor_state motor = axis->drive.state.motor;
    axis_motion_put_scale(&changed, axis->drive.counts_per_mm);
    drive_place(&changed, drive_position_counts(&axis->drive));
    axis->config = config;
    axis->drive = changed;
    if (moves) {
        axis_motion_release(axis, motor);
    }
    axis_motion_rest(axis);
    return 0;
}

bool axis_motion_set_scale(struct axis_motion *axis, double counts_per_mm)
{
    const double scale = counts_per_mm == 0.0 ? (double)axis->config.counts_per_mm : counts_per_mm;
    const double counts = axis->drive.state.motor.position_mm * scale;
    if (!(scale >= 1.0 && scale <= 1e9 && counts < 2147483647.0 && counts > -2147483648.0)) {
        return false;
    }
    if (scale != axis->drive.counts_per_mm) {
        axis_motion_put_scale(&axis->drive, scale);
        axis_motion_release(axis, axis->drive.state.motor);
        axis_motion_rest(axis);
    }
    return true;
}

/* The coordinates of the model are those of the drive, so that a homed axis has the same bits as one that began there.
 * The place of the machine changes instead. */
void axis_motion_shift(struct axis_motion *axis, int32_t from, int32_t to)
{
    const double shift_mm = ((double)to - (double)from) * axis->drive.mm_per_count;
    const bool exactly = axis_motion_position(axis) == from;
    axis->machine_mm -= shift_mm;
    if (exactly) {
        drive_place(&axis->drive, to);
    } else {
        axis->drive.state.motor.position_mm += shift_mm;
        drive_hold(&axis->drive);
    }
    axis_motion_rest(axis);
}

void axis_motion_offsets(struct axis_motion *axis, int32_t speed_counts_s, int16_t torque_permille)
{
    influence_offsets(&axis->influence, &axis->drive, &axis->config, speed_counts_s,
                      torque_permille, axis->rated_torque_nm);
}

void axis_motion_follow(struct axis_motion *axis, int32_t target_counts)
{
    if (influence_acts(&axis->influence, &axis->drive)) {
        influence_period(&axis->influence, &axis->drive, target_counts);
    } else {
        drive_period(&axis->drive, target_counts);
    }
    axis->speed_counts_period = (int64_t)target_counts - axis->target_counts;
    axis->target_counts = target_counts;
}

bool axis_motion_hold(struct axis_motion *axis)
{
    const bool rests = influence_coast(&axis->influence, &axis->drive, axis->brake_volts);
    axis_motion_rest(axis);
    return rests;
}

bool axis_motion_brake(struct axis_motion *axis, enum axis_motion_limit limit)
{
    const struct drive_plant *plant = &axis->config.plant;
    const double volts = limit == AXIS_MOTION_CURRENT
                             ? axis->rated_torque_nm * plant->torque_to_volts
                             : plant->volts_limit;
    const bool rests = influence_brake(&axis->influence, &axis->drive, volts);
    axis_motion_rest(axis);
    return rests;
}

/* Change of speed in one period, counts per period: at least one, so that every ramp ends. */
static int64_t axis_motion_change(const struct axis_motion *axis, uint32_t acceleration_counts_s2)
{
    const double period_s = (double)axis->config.period_us * 1e-6;
    const double change = (double)acceleration_counts_s2 * period_s * period_s;
    return change > 1.0 ? (int64_t)change : 1;
}

bool axis_motion_ramp(struct axis_motion *axis, int64_t speed_counts_period,
                      uint32_t acceleration_counts_s2)
{
    const int64_t change = axis_motion_change(axis, acceleration_counts_s2);
    int64_t speed = axis->speed_counts_period;
    if (speed_counts_period > speed + change) {
        speed += change;
    } else if (speed_counts_period < speed - change) {
        speed -= change;
    } else {
        speed = speed_counts_period;
    }
    int64_t target = axis->target_counts + speed;
    target = target > INT32_MAX ? INT32_MAX : (target < INT32_MIN ? INT32_MIN : target);
    axis_motion_follow(axis, (int32_t)target);
    return speed == speed_counts_period;
}

int32_t axis_motion_position(const struct axis_motion *axis)
{
    return influence_read_counts(&axis->influence, &axis->drive);
}

double axis_motion_place_mm(const struct axis_motion *axis)
{
    return axis->drive.state.motor.position_mm + axis->machine_mm;
}

bool axis_motion_at_standstill(const struct axis_motion *axis)
{
    return axis->drive.state.motor.speed_rad_s == 0.0;
}

bool axis_motion_settled(const struct axis_motion *axis, uint32_t window_counts)
{
    const int64_t distance =
        (int64_t)axis->target_counts - influence_read_counts(&axis->influence, &axis->drive);
    return llabs(distance) <= (int64_t)window_counts;
}

int32_t axis_motion_speed(const struct axis_motion *axis)
{
    const double mm_s = axis->drive.state.motor.speed_rad_s * axis->config.plant.screw_mm_rad;
    return encoder_to_i32(mm_s * axis->drive.counts_per_mm);
}
