/* SPDX-License-Identifier: MIT */
/*
 * piece_check: checks the rules of feed pieces (docs/reference/protocol.md 1.3). A part of program_check. Pure, main
 * loop.
 */
#ifndef HODOGRAPH_CORE_PIECE_CHECK_H
#define HODOGRAPH_CORE_PIECE_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* All pieces in order, and their sum of durations. Returns 0 or the code of the first rule broken;
 * *index is then its piece. */
int piece_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

#endif
