/* SPDX-License-Identifier: MIT */
/* Implements plant/encoder.h (see there): the encoder on the motor shaft. Used by plant/drive, plant/influence and
 * sim/node. Pure functions, any thread. */
#include "plant/encoder.h"

#include <assert.h>

void encoder_init(struct encoder *encoder, double screw_mm_rad, uint32_t counts_per_rev)
{
    const double two_pi = 6.283185307179586476925;
    assert(counts_per_rev >= 1 && screw_mm_rad > 0.0);
    encoder->increment_mm = two_pi * screw_mm_rad / (double)counts_per_rev;
    encoder->increments_per_mm = (double)counts_per_rev / (two_pi * screw_mm_rad);
}

int32_t encoder_to_i32(double value)
{
    if (value >= (double)INT32_MAX) {
        return INT32_MAX;
    }
    if (value <= (double)INT32_MIN) {
        return INT32_MIN;
    }
    return (int32_t)encoder_round(value);
}
