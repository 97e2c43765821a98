/* SPDX-License-Identifier: MIT */
#include "canopen/od.h"

#include <string.h>

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
