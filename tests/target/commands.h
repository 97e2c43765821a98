/* SPDX-License-Identifier: MIT */
/*
 * commands: commands to a motion while it runs, read from a file of pairs of u32, little-endian, in order of their
 * ticks: before this tick (0 is the first), this override in per cent (0 ... 200) or one of the commands below. Used by
 * the images isr and setpoints. Reads the file by semihosting.
 */
#ifndef TARGET_COMMANDS_H
#define TARGET_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/motion.h"

enum { COMMAND_HOLD = 1000, COMMAND_RESUME, COMMAND_STOP };

/* One reader, all zero at first. */
struct commands {
    int file;
    bool more;
    uint32_t next[2]; /* its tick, and what */
};

/* Begins with the first of them. 0, or -1 when the file cannot be opened. */
int commands_open(struct commands *commands, const char *path);

/* Carries out what is due before tick k. Closes the file when nothing is left: `more` is false then. */
void commands_give(struct commands *commands, uint32_t k, struct motion *motion);

/* Leaves out the remaining commands. */
void commands_close(struct commands *commands);

#endif
