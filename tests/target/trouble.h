/* SPDX-License-Identifier: MIT */
/*
 * trouble: what the drives of isr.c do wrong, by a word of the command line. Used by isr.c; no I/O.
 *
 *   silent   both leave every third SYNC unanswered, which 0x2004 sub 9 (1) tolerates
 *   lost:K   the second answers no more from tick K on, which ends the program by a quick stop
 *   error:K  both report a following error from tick K on, which ends it by braking along the path
 */
#ifndef TARGET_TROUBLE_H
#define TARGET_TROUBLE_H

#include <stdbool.h>
#include <stdint.h>

/* Ticks of a program; UINT32_MAX: never. */
struct trouble {
    bool silent;
    uint32_t lost_from;
    uint32_t error_from;
};

/* False when the word is none of those above: then there is no trouble. */
bool trouble_read(struct trouble *trouble, const char *word);

/* Whether each program shall end in a fault. */
bool trouble_is_fatal(const struct trouble *trouble);

#endif
