/* SPDX-License-Identifier: MIT */
/*
 * From mm to bus counts. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_COUNTS_H
#define HODOGRAPH_CORE_COUNTS_H

#include <stdint.h>

/* Position in counts: floor(q40 * counts_per_mm / 2^40 + 1/2), that is round half up (towards plus
 * infinity), in exact arithmetic; saturates at the ends of i32. Python does the same with
 * (q40 * counts_per_mm + 2**39) >> 40. Two 32x32 multiplies, no division. Any q40 is allowed. */
int32_t counts_from_q40_mm(int64_t q40_mm, uint32_t counts_per_mm);

#endif
