/* SPDX-License-Identifier: MIT */
/* program_time: the program time at which a program reaches an arc length: the inverse of F, for a start inside the
 * program. Used by app/machine/motion, and by applications that take the core as a library. Pure, main loop. */
#ifndef HODOGRAPH_CORE_PROGRAM_TIME_H
#define HODOGRAPH_CORE_PROGRAM_TIME_H

#include <stdint.h>

#include "core/program.h"

/* Program time in 2^-42 s at which the fixed and the float kernel reach this arc length: the earliest such time, by
 * bisection of the same polynomial that the tick evaluates. 0 at or below arc length 0, the duration at or beyond the
 * length. Needs a checked program; linear in the number of pieces plus about 64 evaluations. */
uint64_t program_time_at_q42(const struct program *p, int64_t arc_length_q40_mm);

#endif
