/* SPDX-License-Identifier: MIT */
/*
 * limit_check: proves that a program keeps the limits of its path axes (velocity, acceleration, jerk) at every instant,
 * at every feed override that its override bounds allow. docs/guides/limits.md describes what is proved and what is
 * not. A part of program_check. Changes only its result; no I/O.
 *
 * It uses nothing of the image but its coefficients. Time is divided into cells: one feed piece on one segment. In a
 * cell every quantity q of the motion has a bound M of |q''|, by Taylor series with majorants; between two samples h
 * apart q is at most M h^2/8 above the greater one. So samples bound the motion at all times. The check goes from one
 * sample to the next and makes h as great as the limits allow there. Where h would have to be less than a 32nd of the
 * cell, the cell is halved. At the joints of cells a step of velocity or acceleration counts as the jerk that a drive
 * sees: step over period.
 *
 * Integers only (core/real.h): the same verdict on every target. Main loop; no heap, some 3 KiB of stack.
 */
#ifndef HODOGRAPH_CORE_LIMIT_CHECK_H
#define HODOGRAPH_CORE_LIMIT_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* Share of a limit of acceleration or jerk that the steps at a joint may use, in 1/1000. */
#define LIMIT_CHECK_STEP_PERMILLE 5

/* Needs a program that keeps the other rules of program_check. Returns 0, or the code of the first limit that is
 * exceeded or not proved to be kept; *index is then its piece. A limit of 0 is none. */
int limit_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

#endif
