/* SPDX-License-Identifier: MIT */
/*
 * joint_check: whether the direction of a path is continuous from a segment to the next (docs/reference/protocol.md
 * 1.2). Used by core/segment_check. Products are exact. In space the numbers computed from them have a relative error
 * below 2^-26. Pure, main loop.
 */
#ifndef HODOGRAPH_CORE_JOINT_CHECK_H
#define HODOGRAPH_CORE_JOINT_CHECK_H

#include "core/program.h"

/* 1 if the directions differ by at most 2^-20 rad, and the slopes of extra axes by arc length by at most 2^-20 of (1 +
 * slope). Both segments have passed the rules of one segment. */
int joint_goes_on(const struct program_segment *a, const struct program_segment *b);

#endif
