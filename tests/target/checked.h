/* SPDX-License-Identifier: MIT */
/* What the images that check a program have in common: the program in the store, and the limits of
 * examples/machines/paper_alpha.toml. Used by checker.c and stop_checker.c. Reads the store. */
#ifndef TARGET_CHECKED_H
#define TARGET_CHECKED_H

#include "core/program_check.h"

/* Opens the image in the store (the emulator puts it there). Returns the result of program_open: 0, or a negative
 * error. */
int checked_open(struct program *program);

struct program_limits checked_limits(void);

#endif
