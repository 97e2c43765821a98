/* SPDX-License-Identifier: MIT */
/* axis_motion: the simulated axis of a drive node: follows setpoints, makes ramps of its own, or
 * runs out on its brake; its coordinates and its place in the machine.
 *
 * Positions are bus counts as the drive reads them. One call of follow, ramp or hold a bus period.
 * All in one context.
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

/* Parked at a position. Returns 0 or an enum drive_error; then nothing else may be called. */
int axis_motion_init(struct axis_motion *axis, const struct drive_config *config,
                     int32_t position_counts);

/* Another bus period, while the axis stands. Returns 0, or an enum drive_error and nothing changes.
 */
int axis_motion_set_period(struct axis_motion *axis, uint32_t period_us);

/* Other bus counts per mm (0x6091, 0x6092), while the axis stands; 0: those of the configuration.
 * Returns false, and nothing changes, when it is out of 1 ... 10^9 or the position would not fit. */
bool axis_motion_set_scale(struct axis_motion *axis, double counts_per_mm);

/* Gives the coordinates another zero, while the axis stands: where it reads `from` now, it reads
 * `to` from now on. */
void axis_motion_shift(struct axis_motion *axis, int32_t from, int32_t to);

/* Feedforward for the periods that follow: counts/s, and per mille of the rated torque. */
void axis_motion_offsets(struct axis_motion *axis, int32_t speed_counts_s, int16_t torque_permille);

/* One period towards a target. */
void axis_motion_follow(struct axis_motion *axis, int32_t target_counts);

/* One period without power, on the brake. Returns true when the axis is at rest. */
bool axis_motion_hold(struct axis_motion *axis);

/* One period in which the motor brakes with all that its limit allows: of the current (rated torque) or of the voltage.
 * Returns true when the axis is at rest; its target is then where it is. */
enum axis_motion_limit { AXIS_MOTION_CURRENT, AXIS_MOTION_VOLTAGE };
bool axis_motion_brake(struct axis_motion *axis, enum axis_motion_limit limit);

/* One period in which the target's speed nears `speed` (counts a period) by at most the
 * acceleration (counts/s^2). Returns true when it has that speed. */
bool axis_motion_ramp(struct axis_motion *axis, int64_t speed_counts_period,
                      uint32_t acceleration_counts_s2);

/* What the drive reads; where the axis is in the machine; whether it is exactly at rest. */
int32_t axis_motion_position(const struct axis_motion *axis);
double axis_motion_place_mm(const struct axis_motion *axis);
bool axis_motion_at_rest(const struct axis_motion *axis);

/* Whether the position is within `window_counts` of the last target. */
bool axis_motion_settled(const struct axis_motion *axis, uint32_t window_counts);

/* Speed of the motor, counts/s, rounded and saturated. */
int32_t axis_motion_speed(const struct axis_motion *axis);

#endif
