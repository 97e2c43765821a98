/* SPDX-License-Identifier: MIT */
/*
 * program_record: the mark at the end of a bank of the store that says: the program in here is whole.
 *
 *     magic u32 | sequence u32 | image_size u32 | CRC-32 of the twelve bytes before u32
 *
 * little-endian, in the last PROGRAM_RECORD_SIZE bytes. It is written last, when the image has passed every check, so
 * that a bank without a valid record never counts, wherever the power went. Of two valid ones the later sequence
 * (modulo 2^32) is the newer program. Mainline.
 */
#ifndef APP_PROGRAM_RECORD_H
#define APP_PROGRAM_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#define PROGRAM_RECORD_SIZE 16u

struct program_record {
    uint32_t sequence;
    uint32_t image_size; /* bytes */
};

/* Bytes of a bank that are left for a program. */
uint32_t program_record_room(void);

/* False when the bank has no valid record. */
bool program_record_read(unsigned bank, struct program_record *record);

/* Once after each erase, after everything else. 0 or PORT_ERR_STORE. */
int program_record_write(unsigned bank, const struct program_record *record);

/* Whether the first was written after the second. */
bool program_record_newer(const struct program_record *first, const struct program_record *second);

#endif
