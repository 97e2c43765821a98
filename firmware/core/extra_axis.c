/* SPDX-License-Identifier: MIT */
/* Implements core/extra_axis.h (see there): coefficients of an extra axis for the kernels fixed and float. Used by
 * core/kernel_fixed and core/kernel_float. Pure; extra_axis_set in the main loop, the others in the tick. */
#include "core/extra_axis.h"

/* By how much coefficients in q48 are shifted down, so that the sum of all powers fits 31 bits after any rounding. Of
 * the linear one only the remainder counts, which is below 2^31. */
static int shift_of(const int64_t c_q48[6])
{
    int64_t sum = (int64_t)1 << 31;
    for (int i = 2; i < 6; i++) {
        sum += qmath_magnitude(c_q48[i]);
    }
    sum += sum >> PH_MARGIN_BITS;
    const int bits = 64 - qmath_clz64((uint64_t)sum);
    return bits - 31 > 1 ? bits - 31 : 1;
}

void extra_axis_set(struct extra_axis *axis, const struct ph_extra *from)
{
    int64_t c_q48[6];
    for (int i = 0; i < 6; i++) {
        c_q48[i] = from->c_q45[i] * 8;
    }
    const int shift = shift_of(c_q48);
    axis->middle_q48 = c_q48[0];
    axis->linear_q17 = (int32_t)(c_q48[1] >> 31);
    axis->scale = (int32_t)1 << shift;
    c_q48[1] -= (int64_t)axis->linear_q17 * ((int64_t)1 << 31);
    for (int i = 0; i < 5; i++) {
        axis->c[i] = (int32_t)qmath_round(c_q48[i + 1], shift);
        axis->slope_q16[i] = (int32_t)((i + 1) * from->c_q45[i + 1] * (1 << i) >> 29);
    }
}
