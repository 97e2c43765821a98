/* SPDX-License-Identifier: MIT */
/*
 * The rule of docs/reference/protocol.md 1.2 that needs segments and pieces together: no tick crosses more than two
 * segment ends; and what other rules of this kind need. Used by program_check. Main loop.
 */
#ifndef HODOGRAPH_CORE_CROSSING_CHECK_H
#define HODOGRAPH_CORE_CROSSING_CHECK_H

#include "core/program_check.h"

/* Any two adjacent segments (not the first, not the last of the program) are longer than the distance of one tick at
 * 200 % of the highest feed of the pieces on them; a feed below 2^-10 mm/s counts as 2^-10 mm/s. Segments and pieces
 * must have passed their own checks. Linear: pieces and segments advance together. Returns 0 or
 * PROGRAM_ERR_SEGMENT_SHORT with the index of the later of the two. */
int crossing_check_all(const struct program *p, uint32_t *index);

/* 1: pieces from *first on that reach into the stretch from ... to of arc length are so slow that no tick at 200 % covers it;
 * *first moves on past those that end before it. */
int crossing_slow_enough(const struct program *p, int64_t from_q40_mm, int64_t to_q40_mm,
                         uint32_t *first);

#endif
