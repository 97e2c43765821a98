/* SPDX-License-Identifier: MIT */
#include <stdbool.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/od.h"
#include "canopen/sdo_abort.h"

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
