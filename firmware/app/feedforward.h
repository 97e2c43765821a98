/* SPDX-License-Identifier: MIT */
/*
 * feedforward: velocity and torque offsets (0x60B1, 0x60B2) that go with the setpoints of a motion.
 *
 * From differences of the unrounded points p(k) of the setpoints, with the period T:
 *
 *     velocity(k)     = (p(k) - p(k-1)) / T
 *     acceleration(k) = (p(k) - 2 p(k-1) + p(k-2)) / T^2
 *
 * Setpoint k is latched at SYNC k+1 and reached, by linear interpolation, at SYNC k+2, so velocity(k) is
 * exactly that of the period in which the drive has the offset. acceleration(k) is that of SYNC k+1, the
 * beginning of that period: half a period old in its middle. Offsets are rounded to nearest and saturate; they are zero
 * at standstill (equal points) and whenever the motion gives no new setpoint. Integers only.
 */
#ifndef APP_FEEDFORWARD_H
#define APP_FEEDFORWARD_H

#include <stdbool.h>
#include <stdint.h>

#include "app/config.h"
#include "app/motion.h"

struct feedforward_offset {
    int32_t velocity_counts_s; /* 0x60B1 */
    int16_t torque_permille;   /* 0x60B2, of the rated torque */
};

struct feedforward {
    int64_t last_q40_mm[PLANE_AXES];   /* p(k-1) */
    int64_t before_q40_mm[PLANE_AXES]; /* p(k-2) */
    uint32_t setpoints;                /* of the motion, when last looked at; 0: none */
};

void feedforward_init(struct feedforward *feedforward);

/* Offsets of this tick's setpoints; `motion` after its step, or NULL when none is under way. Once a
 * tick while feedforward is configured. Timer. */
void feedforward_step(struct feedforward *feedforward, const struct config *config,
                      const struct motion *motion, struct feedforward_offset offset[PLANE_AXES]);

/* The offset for two differences of an axis's points: p(k) - p(k-1) and the second difference, in
 * 2^-40 mm. Pure. */
struct feedforward_offset feedforward_offset(const struct config *config, uint8_t axis,
                                             int64_t first_q40_mm, int64_t second_q40_mm);

#endif
