/* SPDX-License-Identifier: MIT */
/*
 * counts: converts positions from mm to bus counts. Used by app/machine/path_counts and sim/offline. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_COUNTS_H
#define HODOGRAPH_CORE_COUNTS_H

#include <stdint.h>

#include "core/qmath.h"

/* Position in counts: floor(q40 * counts_per_mm / 2^40 + 1/2), that is round half up (towards plus infinity), in exact
 * arithmetic; saturates at the ends of i32. Python does the same with (q40 * counts_per_mm + 2**39) >> 40. Two 32x32
 * multiplies, no division. Any q40 is allowed. */
static inline int32_t counts_from_q40_mm(int64_t q40_mm, uint32_t counts_per_mm)
{
    /* floor(q40 counts / 2^32), exact: the half of 2^40 is added there, the other 2^8 shifted off.
     * The fraction dropped first cannot change the floor that follows. */
    return qmath_clamp32((qmath_mul_unsigned(q40_mm, counts_per_mm) + 128) >> 8);
}

#endif
