/* SPDX-License-Identifier: MIT */
/*
 * bank_record: the commit record at the end of a bank of the store, which marks the content as complete. Used by
 * app/program_slot, app/program_table and app/parameter_store. Reads and writes the store.
 *
 *     sequence u32 | size u32 | tag u32 | CRC-32 (u32) of the twelve bytes before it
 *
 * little-endian, in the last BANK_RECORD_SIZE bytes. It is written last, when the content has passed every check. A
 * bank without a valid record is ignored: it is empty, or writing its content was not completed (power failure,
 * abandoned or refused upload). Of two banks with valid records for the same kind of content, the one with the later
 * sequence number (modulo 2^32) has the newer content. Main loop.
 */
#ifndef APP_BANK_RECORD_H
#define APP_BANK_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#define BANK_RECORD_SIZE 16u /* bytes */

struct bank_record {
    uint32_t sequence;
    uint32_t size; /* of the content, bytes */
    /* a program: CRC-32 of the configuration it was checked against; parameters: CRC-32 of the content */
    uint32_t tag;
};

/* Bytes of a bank for the content. */
uint32_t bank_record_room(unsigned bank);

/* False when the bank has no valid record. */
bool bank_record_read(unsigned bank, struct bank_record *record);

/* Writes the record. Call it once after each erase, when all content is written. 0 or PORT_ERR_STORE. */
int bank_record_write(unsigned bank, const struct bank_record *record);

/* Whether the first was written after the second. Pure. */
bool bank_record_newer(const struct bank_record *first, const struct bank_record *second);

#endif
