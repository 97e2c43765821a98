/* SPDX-License-Identifier: MIT */
/* od_read_axis: objects with one sub-index for each axis: what its drive said last and what it was sent. Pure, under the
 * lock. */
#ifndef APP_OD_READ_AXIS_H
#define APP_OD_READ_AXIS_H

#include <stdint.h>

#include "app/machine/axis.h"

/* Value of 0x200A ... 0x200E, 0x2017, 0x201B, 0x201C, 0x2024, 0x2026, 0x202B or 0x202C for this axis, two's complement in 64 bits. */
uint64_t od_read_axis(const struct axis *axis, uint16_t index);

#endif
