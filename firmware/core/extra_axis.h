/* SPDX-License-Identifier: MIT */
/*
 * extra_axis: extra axes (after x, y, z) of a spatial program, for the kernels fixed and float. Used by
 * core/kernel_fixed and core/kernel_float. The position of one is a quintic in the curve parameter. Its coefficients
 * are precomputed; the kernel evaluates it at the parameter that it has found for an arc length. Ranges and error:
 * docs/theory/numerics.md section 9, "Extra axes". Positions are in mm, in degrees for a rotary axis. Pure;
 * extra_axis_set in the main loop, the others in the tick.
 */
#ifndef HODOGRAPH_CORE_EXTRA_AXIS_H
#define HODOGRAPH_CORE_EXTRA_AXIS_H

#include <stdint.h>

#include "core/kernel.h"
#include "core/ph_segment.h"
#include "core/qmath.h"

/* Position: middle + linear z 2^-31 (q48) + (c1 z + ... + c5 z^5) times the scale, as in core/kernel_float.h. */
struct extra_axis {
    int64_t middle_q48;
    int32_t linear_q17;
    int32_t scale;
    int32_t c[5];         /* of z ... z^5; the first is the remainder of the linear one */
    int32_t slope_q16[5]; /* derivative in z, coefficient k times 2^k */
};

void extra_axis_set(struct extra_axis *axis, const struct ph_extra *from);

/* Position at z, moved by dz along the slope. */
KERNEL_INLINE int64_t extra_axis_at_q40(const struct extra_axis *axis, int32_t z_q31,
                                        int32_t dz_q44)
{
    int32_t value = axis->c[4];
    int32_t slope = axis->slope_q16[4];
    for (int i = 3; i >= 0; i--) {
        value = 2 * qmath_mul_hi(value, z_q31) + axis->c[i];
        slope = qmath_mul_hi(slope, z_q31) + axis->slope_q16[i];
    }
    value = 2 * qmath_mul_hi(value, z_q31);
    int64_t position_q48 = axis->middle_q48 + qmath_product(value, axis->scale) +
                           qmath_product(axis->linear_q17, z_q31);
    return qmath_round(position_q48 + (qmath_product(slope, dz_q44) >> 12), 8);
}

#endif
