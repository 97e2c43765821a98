/* SPDX-License-Identifier: MIT */
/* Implements app/bank_record.h (see there): the commit record at the end of a bank of the store, which marks the
 * content as complete. Used by app/program_slot, app/program_table and app/parameter_store. Main loop. Reads and writes
 * the store. */
#include "app/bank_record.h"

#include "canopen/cob.h"
#include "core/crc32.h"
#include "port/port.h"

/* Where the CRC begins: so that neither erased memory nor a record of another form passes. */
#define SEED        UINT32_C(0x52444748)
#define CRC_AT      12u                  /* offset of the CRC-32 in the record */
#define HALF_CIRCLE UINT32_C(0x80000000) /* sequence numbers wrap: less than this ahead is newer */

uint32_t bank_record_room(unsigned bank)
{
    return port_store_size(bank) - BANK_RECORD_SIZE;
}

bool bank_record_read(unsigned bank, struct bank_record *record)
{
    const uint8_t *bytes = port_store_data(bank) + bank_record_room(bank);
    record->sequence = cob_get32(bytes);
    record->size = cob_get32(bytes + 4);
    record->tag = cob_get32(bytes + 8);
    return cob_get32(bytes + CRC_AT) == crc32_update(SEED, bytes, CRC_AT) &&
           record->size <= bank_record_room(bank);
}

int bank_record_write(unsigned bank, const struct bank_record *record)
{
    uint8_t bytes[BANK_RECORD_SIZE];
    cob_put32(bytes, record->sequence);
    cob_put32(bytes + 4, record->size);
    cob_put32(bytes + 8, record->tag);
    cob_put32(bytes + CRC_AT, crc32_update(SEED, bytes, CRC_AT));
    return port_store_write(bank, bank_record_room(bank), bytes, BANK_RECORD_SIZE);
}

bool bank_record_newer(const struct bank_record *first, const struct bank_record *second)
{
    const uint32_t ahead = first->sequence - second->sequence;
    return ahead != 0u && ahead < HALF_CIRCLE;
}
