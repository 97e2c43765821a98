/* SPDX-License-Identifier: MIT */
/*
 * The rules of docs/protocol.md 1.3 and the one of 1.2 that needs segments and pieces together.
 * Used by program_check. Main loop.
 */
#ifndef HODOGRAPH_CORE_PIECE_CHECK_H
#define HODOGRAPH_CORE_PIECE_CHECK_H

#include "core/program_check.h"

/* All pieces in order, and their sum of durations. Returns 0 or the code of the first rule broken;
 * *index is then its piece. */
int piece_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

/* Each two neighbouring segments (not the first, not the last of the program) are longer than the
 * way of one tick at 200 % of the highest feed of the pieces over them; a feed below 2^-10 mm/s
 * counts as that. Segments and pieces must have passed their own checks. Linear: pieces and
 * segments advance together. Returns 0 or PROGRAM_ERR_SEGMENT_SHORT with the index of the later of
 * the two. */
int piece_check_crossings(const struct program *p, uint32_t *index);

#endif
