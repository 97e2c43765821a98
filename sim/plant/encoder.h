/* SPDX-License-Identifier: MIT */
/* encoder: the encoder on the motor shaft: rounds the position to the nearest of its increments (ties to even). Used by
 * plant/drive, plant/influence and sim/node. Pure functions, any thread.
 *
 * An increment is 2 pi screw / counts_per_rev mm of table position. The electrical zero is half an increment before the
 * table's zero, so that rounding is to nearest and a table at 0 reads 0.
 */
#ifndef HODOGRAPH_PLANT_ENCODER_H
#define HODOGRAPH_PLANT_ENCODER_H

#include <float.h>
#include <stdint.h>

struct encoder {
    double increment_mm;
    double increments_per_mm;
};

/* screw: mm/rad; counts_per_rev: at least 1. */
void encoder_init(struct encoder *encoder, double screw_mm_rad, uint32_t counts_per_rev);

/* Nearest integer, ties to even, as a double; |value| below 2^51. Adding and taking away 1.5 * 2^52
 * leaves no bits for a fraction: no libm, no branch, the same bits everywhere. Needs the default rounding mode. */
static inline double encoder_round(double value)
{
    const double shift = 6755399441055744.0;
    return (value + shift) - shift;
}

/* The position that the drive sees, mm. */
static inline double encoder_read_mm(const struct encoder *encoder, double position_mm)
{
    return encoder_round(position_mm * encoder->increments_per_mm) * encoder->increment_mm;
}

/* value as i32, rounded as above and saturated. */
int32_t encoder_to_i32(double value);

#endif
