/* SPDX-License-Identifier: MIT */
/* axis_motion: the simulated axis of a drive node. It follows setpoints, makes ramps of its own, or coasts with its
 * brake closed. It has its coordinates and its place in the machine. Used by sim/node only.
 *
 * Positions are bus counts as the drive reads them. One call of follow, ramp, brake or hold in each bus period. The
 * functions change their struct only. All in one context.
 */
#ifndef NODE_AXIS_MOTION_H
#define NODE_AXIS_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"
#include "plant/influence.h"

struct axis_motion {
    struct drive_config config;
    struct drive drive;
    struct influence influence; /* feedforward and injected faults */
    double rated_torque_nm;
    double brake_volts;          /* of the holding brake, as friction; more than 0 */
    double machine_mm;           /* place of the drive's zero in the machine: moved by homing */
    int32_t target_counts;       /* of the last period */
    int64_t speed_counts_period; /* change of the target in the last period */
};

/* Places the axis at standstill at a position. Returns 0 or an enum drive_error; then no other function may be called.
 * */
int axis_motion_init(struct axis_motion *axis, const struct drive_config *config,
                     int32_t position_counts);

/* Another bus period, while the axis has no setpoints: one that stands is placed at a whole count, one that moves goes
 * on moving. Returns 0, or an enum drive_error and nothing changes. */
int axis_motion_set_period(struct axis_motion *axis, uint32_t period_us);

/* Other bus counts per mm (0x6091, 0x6092), while the axis has no setpoints; 0: those of the configuration.
 * Returns false, and nothing changes, when it is out of 1 ... 10^9 or the position would not fit. */
bool axis_motion_set_scale(struct axis_motion *axis, double counts_per_mm);

/* Gives the coordinates another zero, while the axis stands: the position that it reads as `from` is then read as
 * `to`. */
void axis_motion_shift(struct axis_motion *axis, int32_t from, int32_t to);

/* Feedforward for the periods that follow: counts/s, and per mille of the rated torque. */
void axis_motion_offsets(struct axis_motion *axis, int32_t speed_counts_s, int16_t torque_permille);

/* One period towards a target. */
void axis_motion_follow(struct axis_motion *axis, int32_t target_counts);

/* One period without power, with the brake closed. Returns true when the axis is at standstill. */
bool axis_motion_hold(struct axis_motion *axis);

/* One period in which the motor brakes at its limit: of the current (rated torque) or of the voltage. Returns true when
 * the axis is at standstill; its target is then its position. */
enum axis_motion_limit {
    AXIS_MOTION_CURRENT, /* of the current: the rated torque */
    AXIS_MOTION_VOLTAGE  /* of the voltage: the shortest distance */
};
bool axis_motion_brake(struct axis_motion *axis, enum axis_motion_limit limit);

/* One period in which the speed of the target approaches `speed` (counts per period) by at most the acceleration
 * (counts/s^2). Returns true when it has that speed. */
bool axis_motion_ramp(struct axis_motion *axis, int64_t speed_counts_period,
                      uint32_t acceleration_counts_s2);

/* The position that the drive reads; the place of the axis in the machine; whether it is exactly at standstill. */
int32_t axis_motion_position(const struct axis_motion *axis);
double axis_motion_place_mm(const struct axis_motion *axis);
bool axis_motion_at_standstill(const struct axis_motion *axis);

/* Whether the position is within `window_counts` of the last target. */
bool axis_motion_settled(const struct axis_motion *axis, uint32_t window_counts);

/* Speed of the motor, counts/s, rounded and saturated. */
int32_t axis_motion_speed(const struct axis_motion *axis);

#endif
