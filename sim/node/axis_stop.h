/* SPDX-License-Identifier: MIT */
/* axis_stop: stops the axis of a simulated drive: by a ramp (0x6084, 0x6085), or at the motor's limits, as the option
 * codes 0x605A and 0x605E request. Used by node/servo. One call in each period; all in one context. Changes its struct
 * and the axis that it is given; no I/O.
 */
#ifndef NODE_AXIS_STOP_H
#define NODE_AXIS_STOP_H

#include <stdbool.h>
#include <stdint.h>

#include "node/axis_motion.h"
#include "od_drive.h"

/* All zero: no stop has begun. */
struct axis_stop {
    uint32_t settled_us; /* within the position window */
    uint32_t waited_us;  /* since the ramp has ended */
    bool braked;         /* the axis has stopped at the motor's limits, and is held there */
};

/* The next period begins a new stop. */
void axis_stop_reset(struct axis_stop *stop);

/* One period of a stop by a ramp of the setpoint, counts/s^2. Returns true when the stop has ended: the motor has been
 * in the position window 0x6067 for its time 0x6068, or 1 s after the ramp. After that second the brake has to stop a
 * motor that a load or a lost encoder keeps in motion. */
bool axis_stop_ramp(struct axis_stop *stop, struct axis_motion *axis, const struct od_drive *values,
                    uint32_t deceleration_counts_s2);

/* One period of the stop of an option code (1 ... 8; 5 ... 8 as 1 ... 4). Returns true when it has ended. */
bool axis_stop_by_option(struct axis_stop *stop, struct axis_motion *axis,
                         const struct od_drive *values, int16_t option_code);

#endif
