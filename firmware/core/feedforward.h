/* SPDX-License-Identifier: MIT */
/*
 * feedforward: velocity and torque offsets (0x60B1, 0x60B2) that go with the setpoints of one axis.
 *
 * From differences of the unrounded points p(k) of the setpoints, with the period T:
 *
 *     velocity(k)     = (p(k) - p(k-1)) / T
 *     acceleration(k) = (p(k) - 2 p(k-1) + p(k-2)) / T^2
 *
 * Setpoint k is latched at SYNC k+1 and reached, by linear interpolation, at SYNC k+2, so velocity(k) is exactly that
 * of the period in which the drive has the offset. acceleration(k) is that of SYNC k+1, the beginning of that period:
 * half a period old in its middle. Offsets are rounded to nearest and saturate; they are zero at standstill (equal
 * points). Integers only, the same on every target. Used by app/machine/offsets, app/tick and sim/offline/offline.
 * Changes the struct of the axis only; any context.
 */
#ifndef HODOGRAPH_CORE_FEEDFORWARD_H
#define HODOGRAPH_CORE_FEEDFORWARD_H

#include <stdint.h>

struct feedforward_gains {
    uint32_t period_us;                  /* 1000, 2000, 4000 or 8000 */
    uint32_t counts_per_mm;              /* 1 ... 2^23 */
    uint32_t velocity_permille;          /* 0 ... 2000, of the setpoint's velocity */
    int32_t torque_per_acceleration_q16; /* per mille of the rated torque for 1 m/s^2 */
    int32_t torque_per_velocity_q16;     /* the same for 1 m/s */
};

struct feedforward_offset {
    int32_t velocity_counts_s; /* 0x60B1 */
    int16_t torque_permille;   /* 0x60B2, of the rated torque */
};

struct feedforward {
    int64_t last_q40_mm;   /* p(k-1) */
    int64_t before_q40_mm; /* p(k-2) */
};

/* Standstill at a point: that of the first setpoint of a motion. */
void feedforward_begin(struct feedforward *axis, int64_t point_q40_mm);

/* The offset that goes with the next setpoint, which is at this point. */
struct feedforward_offset feedforward_next(struct feedforward *axis,
                                           const struct feedforward_gains *gains,
                                           int64_t point_q40_mm);

/* The offset for two differences: p(k) - p(k-1) and the second difference, in 2^-40 mm. */
struct feedforward_offset feedforward_offset(const struct feedforward_gains *gains,
                                             int64_t first_q40_mm, int64_t second_q40_mm);

#endif
