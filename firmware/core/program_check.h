/* SPDX-License-Identifier: MIT */
/*
 * program_check: the validator. It checks a program before it may run: every rule of docs/reference/protocol.md 1.1 to
 * 1.4 and 1.8, and the limits of the controller. Used by app/program_slot, core/chunk and host tools.
 *
 * Integer arithmetic only, so every target and compiler refuses the same programs with the same code. Constant memory,
 * no recursion; about 10^3 to 10^4 instructions for each segment and piece. Main loop, never an interrupt. It reads the
 * image and changes nothing but *fault.
 */
#ifndef HODOGRAPH_CORE_PROGRAM_CHECK_H
#define HODOGRAPH_CORE_PROGRAM_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* Checks an opened program against all rules. Returns 0, or the code of the first rule broken, in the order header,
 * segments, pieces, limits, stops, events; *fault gets the same code and its index. */
int program_check(const struct program *p, const struct program_limits *limits,
                  struct program_fault *fault);

/* One line in English for a code, never NULL. */
const char *program_error_text(int code);

#endif
