/* SPDX-License-Identifier: MIT */
/*
 * segment_check: checks the rules of docs/reference/protocol.md 1.2 that need segments only: ranges, speed ratio,
 * travel, joints. A part of program_check. Pure, main loop.
 */
#ifndef HODOGRAPH_CORE_SEGMENT_CHECK_H
#define HODOGRAPH_CORE_SEGMENT_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* All segments in order. Returns 0 or the code of the first rule broken; *index is then its segment. */
int segment_check_all(const struct program *p, const struct program_limits *limits,
                      uint32_t *index);

#endif
