/* SPDX-License-Identifier: MIT */
/*
 * first_axis: which axes of a machine a program moves (docs/reference/protocol.md 1.1.1). Axis i of the program is axis
 * first_axis + i of the machine's path. All others hold their position. 0: a path that moves x, y
 * or z. More than 0: only extra axes move; if they are rotary, its unit of length is the degree. Used by firmware/app, core/chunk,
 * core/program_check and sim/offline/offline. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_FIRST_AXIS_H
#define HODOGRAPH_CORE_FIRST_AXIS_H

#include <stdint.h>

#include "core/program.h"

#define FIRST_AXIS_SHIFT 8u
#define FIRST_AXIS_FLAGS 0x0700u /* bits 8 ... 10 of the flags of the header */

static inline uint32_t first_axis(const struct program_header *header)
{
    return ((uint32_t)header->flags & FIRST_AXIS_FLAGS) >> FIRST_AXIS_SHIFT;
}

/* One more than the last axis of the machine's path that the program moves. */
static inline uint32_t first_axis_end(const struct program_header *header)
{
    return first_axis(header) + header->axis_count;
}

#endif
