/* SPDX-License-Identifier: MIT */
/* What the images that check a program have in common: the program in the store, and limits as those of the machines in
 * examples/machines. Used by checker.c and stop_checker.c. Reads the store. */
#ifndef TARGET_CHECKED_H
#define TARGET_CHECKED_H

#include "core/program_check.h"

/* Opens the image in the store (the emulator puts it there). 0, or what program_open says. */
int checked_open(struct program *program);

struct program_limits checked_limits(void);

#endif
