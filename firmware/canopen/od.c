/* SPDX-License-Identifier: MIT */
/* Implements canopen/od.h: finds and moves values of an object dictionary. Used by firmware/canopen, firmware/app and
 * sim/node. Main loop, if not stated otherwise. Changes the struct with the values; no I/O. */
#include "canopen/od.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

static const struct od_hooks no_hooks = {0};

void od_init(struct od *od, const struct od_table *table, void *storage,
             const struct od_hooks *hooks, void *context)
{
    od->table = table;
    od->storage = storage;
    od->hooks = hooks == NULL ? &no_hooks : hooks;
    od->context = context;
}

void od_reset_communication(struct od *od, const void *defaults)
{
    for (uint16_t i = 0; i < od->table->entry_count; i++) {
        const struct od_entry *entry = &od->table->entries[i];
        if (entry->index < OD_FIRST_MANUFACTURER && entry->size > 0u) {
            memcpy(od->storage + entry->offset, (const uint8_t *)defaults + entry->offset,
                   entry->size);
        }
    }
}

static uint32_t key_of(uint16_t index, uint8_t sub)
{
    return ((uint32_t)index << 8) | sub;
}

/* The first entry that is not below (index, sub): may be one past the end. */
static uint16_t lower_bound(const struct od_table *table, uint32_t key)
{
    uint16_t low = 0;
    uint16_t high = table->entry_count;

    while (low < high) {
        uint16_t middle = (uint16_t)(low + (high - low) / 2);
        const struct od_entry *entry = &table->entries[middle];

        if (key_of(entry->index, entry->sub) < key) {
            low = (uint16_t)(middle + 1);
        } else {
            high = middle;
        }
    }
    return low;
}

const struct od_entry *od_find(const struct od *od, uint16_t index, uint8_t sub)
{
    uint16_t i = lower_bound(od->table, key_of(index, sub));

    if (i == od->table->entry_count) {
        return NULL;
    }
    const struct od_entry *entry = &od->table->entries[i];
    return entry->index == index && entry->sub == sub ? entry : NULL;
}

uint32_t od_missing(const struct od *od, uint16_t index, uint8_t sub)
{
    if (od_find(od, index, sub) != NULL) {
        return SDO_OK;
    }
    uint16_t i = lower_bound(od->table, key_of(index, 0));
    if (i < od->table->entry_count && od->table->entries[i].index == index) {
        return SDO_ABORT_NO_SUB;
    }
    return SDO_ABORT_NO_OBJECT;
}

uint32_t od_size(const struct od *od, const struct od_entry *entry)
{
    uint32_t size = 0;

    if (entry->type != OD_VISIBLE_STRING) {
        return entry->size;
    }
    while (size < entry->size && od->storage[entry->offset + size] != 0) {
        size++;
    }
    return size;
}

uint64_t od_number(const struct od *od, const struct od_entry *entry)
{
    const uint8_t *field = od->storage + entry->offset;
    uint16_t u16;
    uint32_t u32;
    uint64_t u64;

    switch (entry->size) {
    case 1:
        return *field;
    case 2:
        memcpy(&u16, field, sizeof u16);
        return u16;
    case 4:
        memcpy(&u32, field, sizeof u32);
        return u32;
    default:
        memcpy(&u64, field, sizeof u64);
        return u64;
    }
}

void od_set_number(struct od *od, const struct od_entry *entry, uint64_t value)
{
    uint8_t *field = od->storage + entry->offset;
    uint16_t u16 = (uint16_t)(value & 0xFFFFu);
    uint32_t u32 = (uint32_t)(value & 0xFFFFFFFFu);

    switch (entry->size) {
    case 1:
        *field = (uint8_t)(value & 0xFFu);
        break;
    case 2:
        memcpy(field, &u16, sizeof u16);
        break;
    case 4:
        memcpy(field, &u32, sizeof u32);
        break;
    default:
        memcpy(field, &value, sizeof value);
        break;
    }
}

static bool is_string(const struct od_entry *entry)
{
    return entry->type == OD_VISIBLE_STRING || entry->type == OD_OCTET_STRING;
}

static bool is_signed(const struct od_entry *entry)
{
    return entry->type == OD_INTEGER8 || entry->type == OD_INTEGER16 ||
           entry->type == OD_INTEGER32 || entry->type == OD_INTEGER64;
}

uint32_t od_read(struct od *od, const struct od_entry *entry, uint8_t *out, uint32_t capacity,
                 uint32_t *size)
{
    uint32_t code = SDO_OK;

    if ((entry->access & OD_READ) == 0) {
        return SDO_ABORT_WRITE_ONLY;
    }
    if (entry->type == OD_DOMAIN) {
        return SDO_ABORT_ACCESS;
    }
    if (od->hooks->read != NULL) {
        code = od->hooks->read(od->context, entry);
    }
    if (code != SDO_OK) {
        return code;
    }
    *size = od_size(od, entry);
    if (*size > capacity) {
        return SDO_ABORT_MEMORY;
    }
    if (is_string(entry)) {
        memcpy(out, od->storage + entry->offset, *size);
    } else {
        cob_put(out, od_number(od, entry), *size);
    }
    return SDO_OK;
}

static uint32_t check_size(const struct od_entry *entry, uint32_t size)
{
    if (size > entry->size) {
        return SDO_ABORT_TOO_LONG;
    }
    if (size < entry->size && entry->type != OD_VISIBLE_STRING) {
        return SDO_ABORT_TOO_SHORT;
    }
    return SDO_OK;
}

static uint32_t check_range(const struct od_table *table, const struct od_entry *entry,
                            uint64_t raw)
{
    int64_t value = is_signed(entry) ? cob_signed(raw, entry->size) : (int64_t)raw;

    if (entry->type == OD_BOOLEAN && raw > 1) {
        return SDO_ABORT_VALUE;
    }
    for (uint16_t i = 0; i < table->range_count; i++) {
        const struct od_range *range = &table->ranges[i];

        if (range->index == entry->index && range->sub == entry->sub) {
            if (value > range->high) {
                return SDO_ABORT_TOO_HIGH;
            }
            return value < range->low ? SDO_ABORT_TOO_LOW : SDO_OK;
        }
    }
    return SDO_OK;
}

uint32_t od_check_number(const struct od *od, const struct od_entry *entry, uint64_t value)
{
    return check_range(od->table, entry, value);
}

static uint32_t check_write(struct od *od, const struct od_entry *entry, const uint8_t *value,
                            uint32_t size)
{
    uint32_t code;

    if ((entry->access & OD_WRITE) == 0) {
        return SDO_ABORT_READ_ONLY;
    }
    if (entry->type == OD_DOMAIN) {
        return SDO_ABORT_ACCESS;
    }
    code = check_size(entry, size);
    if (code == SDO_OK && !is_string(entry)) {
        code = check_range(od->table, entry, cob_get(value, size));
    }
    if (code == SDO_OK && od->hooks->write != NULL) {
        code = od->hooks->write(od->context, entry, value, size);
    }
    return code;
}

uint32_t od_write(struct od *od, const struct od_entry *entry, const uint8_t *value, uint32_t size)
{
    uint32_t code = check_write(od, entry, value, size);

    if (code != SDO_OK) {
        return code;
    }
    if (is_string(entry)) {
        memset(od->storage + entry->offset, 0, entry->size);
        memcpy(od->storage + entry->offset, value, size);
    } else {
        od_set_number(od, entry, cob_get(value, size));
    }
    if (od->hooks->written != NULL) {
        od->hooks->written(od->context, entry);
    }
    return SDO_OK;
}
