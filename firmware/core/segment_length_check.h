/* SPDX-License-Identifier: MIT */
/*
 * segment_length_check: minimum segment length (docs/reference/protocol.md 1.2): no tick crosses more than two segment
 * ends. This rule needs segments and feed pieces together. Used by program_check and event_check. Main loop. Changes
 * only its result; no I/O.
 */
#ifndef HODOGRAPH_CORE_SEGMENT_LENGTH_CHECK_H
#define HODOGRAPH_CORE_SEGMENT_LENGTH_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* Any two adjacent segments (not the first, not the last of the program) are longer than the distance of one tick at
 * 200 % of the highest feed of the pieces on them; a feed below 2^-10 mm/s counts as 2^-10 mm/s. Segments and pieces
 * must have passed their own checks. Linear: pieces and segments advance together. Returns 0 or
 * PROGRAM_ERR_SEGMENT_SHORT with the index of the later of the two. */
int segment_length_check_all(const struct program *p, uint32_t *index);

/* 1: the length from ... to is longer than the distance of one tick at 200 % of the highest feed of the pieces on it,
 * else 0. Pieces are searched from *first on, which moves past those that end before the length; 0 for the first
 * call. */
int length_exceeds_tick(const struct program *p, int64_t from_q40_mm, int64_t to_q40_mm,
                        uint32_t *first);

#endif
