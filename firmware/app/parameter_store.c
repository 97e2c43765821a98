/* SPDX-License-Identifier: MIT */
/* Implements app/parameter_store.h (see there): parameters of the object dictionary that are kept without power
 * (objects 0x1010 and 0x1011). Called by app/controller.c and app/objects.c. Main loop. Erases and writes the parameter
 * banks of the store; restoring writes the dictionary. */
#include "app/parameter_store.h"

#include <stddef.h>
#include <string.h>

#include "app/bank_record.h"
#include "app/machine/config.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "core/crc32.h"
#include "port/port.h"

#define HEADER_BYTES 12u     /* CRC-32 of the layout, and the next two */
#define CONFIG_AT    4u      /* offset of the CRC-32 of the configuration */
#define CONFIRMED_AT 8u      /* offset of the byte: the host confirmed it */
#define NUMBER_MAX   8u      /* bytes of the greatest number */
#define NODE_NUMBER  0x2054u /* object: node number of the controller */
#define ALIGNMENT    8u      /* port.h: what is written can be read at multiples of it */

static bool is_parameter(const struct od_entry *entry)
{
    const uint16_t index = entry->index;
    const uint8_t both = OD_READ | OD_WRITE;
    return (entry->access & both) == both && entry->size > 0u && entry->size <= NUMBER_MAX &&
           (index == 0x1006u || index == 0x1016u || index == 0x1017u || index == 0x1029u ||
            index == NODE_NUMBER || config_contains(index));
}

/* The next parameter after `entry`, or the first one (NULL); NULL at the end. */
static const struct od_entry *next_parameter(const struct od *od, const struct od_entry *entry)
{
    const struct od_entry *end = od->table->entries + od->table->entry_count;
    const struct od_entry *next = entry == NULL ? od->table->entries : entry + 1;
    while (next < end && !is_parameter(next)) {
        next++;
    }
    return next < end ? next : NULL;
}

static uint32_t layout_crc(const struct od *od)
{
    uint32_t crc = 0;
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL;
         p = next_parameter(od, p)) {
        uint8_t bytes[4];
        cob_put16(bytes, p->index);
        bytes[2] = p->sub;
        bytes[3] = (uint8_t)p->size;
        crc = crc32_update(crc, bytes, sizeof bytes);
    }
    return crc;
}

static uint32_t content_bytes(const struct od *od)
{
    uint32_t bytes = HEADER_BYTES;
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL;
         p = next_parameter(od, p)) {
        bytes += p->size;
    }
    return (bytes + ALIGNMENT - 1u) / ALIGNMENT * ALIGNMENT;
}

static bool values_allowed(const struct od *od, const uint8_t *value)
{
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL;
         p = next_parameter(od, p)) {
        const uint64_t number = cob_get(value, p->size);
        if (od_check_number(od, p, number) != SDO_OK ||
            (config_contains(p->index) && !config_value_allowed(p->index, p->sub, number))) {
            return false;
        }
        value += p->size;
    }
    return true;
}

static enum parameter_store_state judge(const struct bank_record *record, unsigned bank,
                                        const struct od *od)
{
    const uint8_t *content = port_store_data(bank);
    if (record->size == 0u) {
        return PARAMETER_STORE_DEFAULTS;
    }
    if (crc32_update(0, content, record->size) != record->tag || record->size < HEADER_BYTES) {
        return PARAMETER_STORE_DAMAGED;
    }
    if (record->size != content_bytes(od) || cob_get32(content) != layout_crc(od)) {
        return PARAMETER_STORE_OTHER;
    }
    return values_allowed(od, content + HEADER_BYTES) ? PARAMETER_STORE_WHOLE
                                                      : PARAMETER_STORE_DAMAGED;
}

static void take(struct parameter_store *store, const struct od *od, unsigned bank,
                 const struct bank_record *record)
{
    const uint8_t *content = port_store_data(bank);
    store->bank = bank;
    store->sequence = record->sequence;
    store->state = judge(record, bank, od);
    const bool whole = store->state == PARAMETER_STORE_WHOLE;
    store->config_crc32 = whole ? cob_get32(content + CONFIG_AT) : 0u;
    store->confirmed = whole && content[CONFIRMED_AT] == 1u;
}

void parameter_store_find(struct parameter_store *store, const struct od *od)
{
    struct bank_record newest = {0};
    unsigned at = PORT_STORE_BANKS_ALL;
    for (unsigned bank = PORT_STORE_PARAMETERS; bank < PORT_STORE_BANKS_ALL; ++bank) {
        struct bank_record record;
        if (bank_record_read(bank, &record) &&
            (at == PORT_STORE_BANKS_ALL || bank_record_newer(&record, &newest))) {
            newest = record;
            at = bank;
        }
    }
    memset(store, 0, sizeof *store);
    store->bank = PORT_STORE_PARAMETERS;
    if (at < PORT_STORE_BANKS_ALL) {
        take(store, od, at, &newest);
    }
}

bool parameter_store_restore(const struct parameter_store *store, struct od *od, uint16_t first,
                             uint16_t last)
{
    if (store->state != PARAMETER_STORE_WHOLE) {
        return false;
    }
    const uint8_t *value = port_store_data(store->bank) + HEADER_BYTES;
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL;
         p = next_parameter(od, p)) {
        if (p->index >= first && p->index <= last) {
            od_set_number(od, p, cob_get(value, p->size));
        }
        value += p->size;
    }
    return true;
}

/* Writes the content in order and counts its bytes. */
struct writer {
    unsigned bank;
    uint32_t offset;
    uint32_t crc;
    int result;
};

static void put(struct writer *writer, const uint8_t *bytes, uint32_t size)
{
    if (writer->result == 0) {
        writer->result = port_store_write(writer->bank, writer->offset, bytes, size);
    }
    writer->crc = crc32_update(writer->crc, bytes, size);
    writer->offset += size;
}

static void put_content(struct writer *writer, const struct od *od, const uint8_t *header)
{
    static const uint8_t zeros[ALIGNMENT] = {0};
    put(writer, header, HEADER_BYTES);
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL;
         p = next_parameter(od, p)) {
        uint8_t bytes[NUMBER_MAX];
        cob_put(bytes, od_number(od, p), p->size);
        put(writer, bytes, p->size);
    }
    put(writer, zeros, (0u - writer->offset) % ALIGNMENT);
}

static void make_header(uint8_t header[HEADER_BYTES], const struct od *od, uint32_t config_crc32,
                        bool confirmed)
{
    memset(header, 0, HEADER_BYTES);
    cob_put32(header, layout_crc(od));
    cob_put32(header + CONFIG_AT, config_crc32);
    header[CONFIRMED_AT] = confirmed ? 1u : 0u;
}

/* Whether exactly this content is stored: then a write would only wear the memory. */
static bool is_stored(const struct parameter_store *store, const struct od *od,
                      const uint8_t *header)
{
    if (store->state != PARAMETER_STORE_WHOLE) {
        return false;
    }
    const uint8_t *content = port_store_data(store->bank);
    bool same = memcmp(content, header, HEADER_BYTES) == 0;
    content += HEADER_BYTES;
    for (const struct od_entry *p = next_parameter(od, NULL); p != NULL && same;
         p = next_parameter(od, p)) {
        same = cob_get(content, p->size) == od_number(od, p);
        content += p->size;
    }
    return same;
}

static unsigned spare_bank(const struct parameter_store *store)
{
    const bool first =
        store->bank == PORT_STORE_PARAMETERS && store->state != PARAMETER_STORE_EMPTY;
    return first ? PORT_STORE_PARAMETERS + 1u : PORT_STORE_PARAMETERS;
}

/* Reads the content again, because the memory may not have taken it; then writes the record. */
static int seal(struct parameter_store *store, unsigned bank, uint32_t size, uint32_t crc)
{
    const struct bank_record record = {.sequence = store->sequence + 1u, .size = size, .tag = crc};
    struct bank_record found;
    if (crc32_update(0, port_store_data(bank), size) != crc) {
        return PORT_ERR_STORE;
    }
    if (bank_record_write(bank, &record) != 0 || !bank_record_read(bank, &found) ||
        found.sequence != record.sequence) {
        return PORT_ERR_STORE;
    }
    store->bank = bank;
    store->sequence = record.sequence;
    return 0;
}

int parameter_store_save(struct parameter_store *store, const struct od *od, uint32_t config_crc32,
                         bool confirmed)
{
    uint8_t header[HEADER_BYTES];
    make_header(header, od, config_crc32, confirmed);
    if (is_stored(store, od, header)) {
        return 0;
    }
    struct writer writer = {.bank = spare_bank(store)};
    if (content_bytes(od) > bank_record_room(writer.bank) || port_store_erase(writer.bank) != 0) {
        return PORT_ERR_STORE;
    }
    put_content(&writer, od, header);
    if (writer.result != 0 || seal(store, writer.bank, writer.offset, writer.crc) != 0) {
        return PORT_ERR_STORE;
    }
    store->state = PARAMETER_STORE_WHOLE;
    store->config_crc32 = config_crc32;
    store->confirmed = confirmed;
    return 0;
}

int parameter_store_forget(struct parameter_store *store)
{
    const unsigned bank = spare_bank(store);
    if (store->state == PARAMETER_STORE_DEFAULTS || store->state == PARAMETER_STORE_EMPTY) {
        return 0;
    }
    if (port_store_erase(bank) != 0 || seal(store, bank, 0, 0) != 0) {
        return PORT_ERR_STORE;
    }
    store->state = PARAMETER_STORE_DEFAULTS;
    store->config_crc32 = 0;
    store->confirmed = false;
    return 0;
}
