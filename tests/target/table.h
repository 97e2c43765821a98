/* SPDX-License-Identifier: MIT */
/*
 * table: the place after the programs in the store where a program's coefficient records (core/coefficients.h) go. Used
 * by the images isr and setpoints. Writes to the store.
 */
#ifndef TARGET_TABLE_H
#define TARGET_TABLE_H

#include "core/program.h"

#define TABLE_AT 0x14000u /* of the store: what is before is for programs */

/* Makes the records of a program for a kernel and gives them to it; those of the program before are lost. 0, or -1 when
 * they do not fit. */
int table_make(struct program *program, uint32_t kernel);

#endif
