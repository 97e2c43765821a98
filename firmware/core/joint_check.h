/* SPDX-License-Identifier: MIT */
/*
 * Whether a path goes on smoothly from a segment to the next: part of core/segment_check. Products are exact. In space
 * the numbers computed from them are within 2^-26 of themselves. docs/reference/protocol.md 1.2. Pure, main loop.
 */
#ifndef HODOGRAPH_CORE_JOINT_CHECK_H
#define HODOGRAPH_CORE_JOINT_CHECK_H

#include "core/program.h"

/* 1 when the direction goes on within 2^-20 rad, and the slopes of extra axes by arc length within 2^-20 of one and the
 * slope. Both segments have passed the rules of one segment. */
int joint_goes_on(const struct program_segment *a, const struct program_segment *b);

#endif
