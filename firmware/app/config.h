/* SPDX-License-Identifier: MIT */
/* config: what the host has configured (objects 0x1006, 0x2004 ... 0x2007), as one value. */
#ifndef APP_CONFIG_H
#define APP_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/od.h"
#include "core/program_check.h"

#define AXES_MAX   6u
#define PLANE_AXES 2u /* axes 0 and 1 follow the path, the others hold */

/* Above it the conversion of travel limits to q40 mm would leave 64 bits. */
#define CONFIG_COUNTS_PER_MM_MAX 8388608u

struct config {
    uint32_t period_us; /* 1000, 2000, 4000 or 8000 */
    uint32_t feed_limit_um_s;
    uint32_t acceleration_limit_um_s2;
    uint32_t jerk_limit_mm_s3;
    uint32_t start_tolerance_counts;
    uint32_t counts_per_mm;
    int32_t travel_min_counts[AXES_MAX];
    int32_t travel_max_counts[AXES_MAX];
    uint8_t node[AXES_MAX];
    uint8_t axis_count; /* 1 ... AXES_MAX */
    uint8_t kernel;     /* enum interp_kernel */
};

/* Copies the present values out of the dictionary. Mainline. */
void config_read(struct config *config, const struct od *od);

/* Whether a value for the object is one that the dictionary's own ranges would let pass but that
 * makes no sense: a period that is not 1, 2, 4 or 8 ms; too many counts per mm. Pure. */
bool config_value_allowed(uint16_t index, uint8_t sub, uint64_t value);

/* Whether a change of the object concerns the drives, so that they must be configured anew. Pure.
 */
bool config_concerns_drives(uint16_t index, uint8_t sub);

/* True for all objects above. Pure. */
bool config_contains(uint16_t index);

/* The limits in the form that program_check takes; travel is rounded inwards. Mainline. */
void config_limits(const struct config *config, struct program_limits *limits);

#endif
