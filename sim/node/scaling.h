/* SPDX-License-Identifier: MIT */
/* scaling: bus counts per mm of a simulated drive, from encoder resolution 0x608F, gear ratio 0x6091 and feed constant
 * 0x6092 (CiA 402-2). Each function checks a write to one object, applies it to the axis, and returns an SDO abort code
 * or SDO_OK; the dictionary stores the value of the object afterwards. Used by node/drive_od. The one thread of
 * hodograph-drive. Changes the axis that it is given; no I/O.
 */
#ifndef NODE_SCALING_H
#define NODE_SCALING_H

#include <stdbool.h>
#include <stdint.h>

#include "node/axis_motion.h"
#include "od_drive.h"

/* Feed constant of the axis as configured: counts a revolution of the motor, which need not be whole. */
double scaling_own_feed(const struct axis_motion *axis);

/* 0x608F sub 1, 2. The encoder is part of the motor: its resolution can be confirmed, not changed. */
uint32_t scaling_write_encoder(const struct axis_motion *axis, uint8_t sub, uint32_t value);

/* 0x6091 sub 1, 2 and 0x6092 sub 1, 2. `permitted`: the drive is without power; the axis must be at standstill as well.
 * The ratios of the configuration give its exact scale, even if no ratio of whole numbers is exact. */
uint32_t scaling_write_gear(struct axis_motion *axis, const struct od_drive *values, uint8_t sub,
                            uint32_t value, bool permitted);
uint32_t scaling_write_feed(struct axis_motion *axis, const struct od_drive *values, uint8_t sub,
                            uint32_t value, bool permitted);

#endif
