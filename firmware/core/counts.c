/* SPDX-License-Identifier: MIT */
#include "core/counts.h"

#include "core/qmath.h"

int32_t counts_from_q40_mm(int64_t q40_mm, uint32_t counts_per_mm)
{
    /* floor(q40 counts / 2^32), exact: the half of 2^40 is added there, the other 2^8 shifted off.
     * The fraction dropped first cannot change the floor that follows. */
    return qmath_clamp32((qmath_mul_unsigned(q40_mm, counts_per_mm) + 128) >> 8);
}
