/* SPDX-License-Identifier: MIT */
#include "app/program_record.h"

#include "core/crc32.h"
#include "port/port.h"

#define MAGIC       0x4B4F4748u /* "HGOK" */
#define CRC_AT      12u
#define HALF_CIRCLE 0x80000000u

static void put_u32(uint8_t *bytes, uint32_t value)
{
    for (unsigned i = 0; i < 4u; ++i) {
        bytes[i] = (uint8_t)(value >> (8u * i));
    }
}

static uint32_t get_u32(const uint8_t *bytes)
{
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

uint32_t program_record_room(void)
{
    return port_store_size() - PROGRAM_RECORD_SIZE;
}

bool program_record_read(unsigned bank, struct program_record *record)
{
    const uint8_t *bytes = port_store_data(bank) + program_record_room();
    record->sequence = get_u32(bytes + 4);
    record->image_size = get_u32(bytes + 8);
    return get_u32(bytes) == MAGIC && get_u32(bytes + CRC_AT) == crc32_update(0, bytes, CRC_AT) &&
           record->image_size <= program_record_room();
}

int program_record_write(unsigned bank, const struct program_record *record)
{
    uint8_t bytes[PROGRAM_RECORD_SIZE];
    put_u32(bytes, MAGIC);
    put_u32(bytes + 4, record->sequence);
    put_u32(bytes + 8, record->image_size);
    put_u32(bytes + CRC_AT, crc32_update(0, bytes, CRC_AT));
    return port_store_write(bank, program_record_room(), bytes, PROGRAM_RECORD_SIZE);
}

bool program_record_newer(const struct program_record *first, const struct program_record *second)
{
    const uint32_t ahead = first->sequence - second->sequence;
    return ahead != 0u && ahead < HALF_CIRCLE;
}
