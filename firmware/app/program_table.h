/* SPDX-License-Identifier: MIT */
/*
 * program_table: stores the coefficient records (core/coefficients.h) of a program in its bank, after the image. They
 * are for the kernel that the tick uses. The controller computes them when an upload has passed its checks. After
 * power-on it compares the stored records with those that it would write. Used by app/program_slot. Main loop. Reads
 * and writes the bank of the store that it is given.
 */
#ifndef APP_PROGRAM_TABLE_H
#define APP_PROGRAM_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/program.h"

/* `attend` is called at each record: a board writes for seconds, and the drives wait for heartbeats. It may be NULL. */
struct program_table_user {
    void (*attend)(void *self);
    void *self;
};

/* Calls `attend`, if there is one. */
static inline void program_table_attend(const struct program_table_user *user)
{
    if (user->attend != NULL) {
        user->attend(user->self);
    }
}

/* Writes the records and gives them to the program. 0, PROGRAM_ERR_ROOM when image and records do not fit the bank,
 * PROGRAM_ERR_STORE, or PROGRAM_ERR_KERNEL when this image has no such kernel. The bank must be erased after the
 * image. */
int program_table_write(unsigned bank, struct program *program, uint32_t kernel,
                        struct program_table_user user);

/* Gives the stored records to the program, if it does not have them yet and every byte of them is right. True if it has
 * them now. */
bool program_table_find(unsigned bank, struct program *program, uint32_t kernel,
                        struct program_table_user user);

#endif
