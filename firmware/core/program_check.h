/* SPDX-License-Identifier: MIT */
/*
 * Checks a program before it may run: every rule of docs/reference/protocol.md 1.1 to 1.3 and the limits of
 * the controller. Integer arithmetic only, so every target and compiler refuses the same programs
 * with the same code. One pass over the image, constant memory, no recursion; about 10^3 to 10^4
 * instructions per segment and piece. Call it from the main loop, not from an interrupt.
 */
#ifndef HODOGRAPH_CORE_PROGRAM_CHECK_H
#define HODOGRAPH_CORE_PROGRAM_CHECK_H

#include "core/program.h"
#include "core/program_rules.h"

/* Checks an opened program against all rules. Returns 0, or the code of the first rule broken
 * (header, then segments, then pieces, in order); *fault gets the same code and its index. */
int program_check(const struct program *p, const struct program_limits *limits,
                  struct program_fault *fault);

/* One line in English for a code, never NULL. */
const char *program_error_text(int code);

#endif
