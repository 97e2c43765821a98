/* SPDX-License-Identifier: MIT */
/* Implements small_od.h (see there): a small object dictionary with recording hooks, for the tests of od and SDO.
 * Part of the C tests; no I/O. */
#include "small_od.h"

#include <string.h>

#include "canopen/sdo_abort.h"
#include "unity.h"

#define AT(field) ((uint32_t)offsetof(struct small_values, field))
#define RW        (OD_READ | OD_WRITE)

static const struct od_entry entries[] = {
    {AT(device_type), 0x1000, 4, 0, OD_UNSIGNED32, OD_READ},
    {AT(name), 0x1008, 8, 0, OD_VISIBLE_STRING, OD_READ},
    {AT(limited), 0x2000, 1, 0, OD_UNSIGNED8, RW},
    {AT(with_sign), 0x2001, 2, 0, OD_INTEGER16, RW | OD_MAPPABLE},
    {AT(secret), 0x2002, 2, 0, OD_UNSIGNED16, OD_WRITE},
    {AT(word), 0x2003, 4, 0, OD_UNSIGNED32, RW},
    {AT(count), 0x2004, 1, 0, OD_UNSIGNED8, OD_READ},
    {AT(wide), 0x2004, 8, 1, OD_UNSIGNED64, RW},
    {AT(wide_constant), 0x2004, 8, 3, OD_INTEGER64, OD_READ},
    {0, 0x2005, 0, 0, OD_DOMAIN, RW},
    {AT(text), 0x2006, 20, 0, OD_VISIBLE_STRING, RW},
    {AT(flag), 0x2007, 1, 0, OD_BOOLEAN, RW},
    {AT(octets), 0x2008, 5, 0, OD_OCTET_STRING, RW},
    {AT(computed), 0x2009, 4, 0, OD_UNSIGNED32, OD_READ},
};

static const struct od_range ranges[] = {
    {1, 5, 0x2000, 0},
    {-100, 100, 0x2001, 0},
};

static const struct od_table table = {
    .entries = entries,
    .ranges = ranges,
    .entry_count = sizeof entries / sizeof entries[0],
    .range_count = sizeof ranges / sizeof ranges[0],
    .storage_size = sizeof(struct small_values),
};

static uint32_t on_read(void *context, const struct od_entry *entry)
{
    struct small_od *small = context;

    if (entry->index == 0x2009) {
        small->values.computed++;
    }
    return small->read_refusal;
}

static uint32_t on_write(void *context, const struct od_entry *entry, const uint8_t *value,
                         uint32_t size)
{
    struct small_od *small = context;

    (void)value;
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(entry->size, size);
    return small->veto;
}

static void on_written(void *context, const struct od_entry *entry)
{
    struct small_od *small = context;

    (void)entry;
    small->written++;
}

static uint32_t on_domain_begin(void *context, const struct od_entry *entry, uint32_t size)
{
    struct small_od *small = context;

    (void)entry;
    if (small->begin_refusal != SDO_OK || size > SMALL_DOMAIN_MAX) {
        return small->begin_refusal != SDO_OK ? small->begin_refusal : SDO_ABORT_MEMORY;
    }
    TEST_ASSERT_FALSE_MESSAGE(small->open, "a download began inside another one");
    small->open = true;
    small->begun++;
    small->announced = size;
    small->domain_size = 0;
    return SDO_OK;
}

static uint32_t on_domain_write(void *context, const struct od_entry *entry, uint32_t offset,
                                const uint8_t *data, uint32_t size)
{
    struct small_od *small = context;

    (void)entry;
    TEST_ASSERT_TRUE(small->open);
    TEST_ASSERT_EQUAL_UINT32(small->domain_size, offset);
    if (small->write_refusal != SDO_OK) {
        return small->write_refusal;
    }
    if (size > SMALL_DOMAIN_MAX - offset) {
        return SDO_ABORT_MEMORY;
    }
    memcpy(small->domain + offset, data, size);
    small->domain_size += size;
    return SDO_OK;
}

static uint32_t on_domain_end(void *context, const struct od_entry *entry, uint32_t size)
{
    struct small_od *small = context;

    (void)entry;
    TEST_ASSERT_TRUE(small->open);
    TEST_ASSERT_EQUAL_UINT32(small->domain_size, size);
    if (small->end_refusal == SDO_OK) {
        small->open = false;
        small->ended++;
    }
    return small->end_refusal;
}

static void on_domain_abort(void *context, const struct od_entry *entry)
{
    struct small_od *small = context;

    (void)entry;
    TEST_ASSERT_TRUE(small->open);
    small->open = false;
    small->aborted++;
}

static uint32_t on_domain_size(void *context, const struct od_entry *entry, uint32_t *size)
{
    const struct small_od *small = context;

    (void)entry;
    *size = small->domain_size;
    return SDO_OK;
}

static uint32_t on_domain_read(void *context, const struct od_entry *entry, uint32_t offset,
                               uint8_t *data, uint32_t size)
{
    const struct small_od *small = context;

    (void)entry;
    TEST_ASSERT_TRUE(offset <= small->domain_size && size <= small->domain_size - offset);
    memcpy(data, small->domain + offset, size);
    return SDO_OK;
}

/* As a command to stop: the greatest value of `limited`. */
static bool is_urgent(const struct od_entry *entry, uint8_t value)
{
    return entry->index == 0x2000u && value == SMALL_URGENT;
}

static const struct od_hooks hooks = {
    .read = on_read,
    .write = on_write,
    .urgent = is_urgent,
    .written = on_written,
    .domain_begin = on_domain_begin,
    .domain_write = on_domain_write,
    .domain_end = on_domain_end,
    .domain_abort = on_domain_abort,
    .domain_size = on_domain_size,
    .domain_read = on_domain_read,
};

void small_od_init(struct small_od *small)
{
    memset(small, 0, sizeof *small);
    small->values.device_type = 0x12345678;
    memcpy(small->values.name, "Small OD", 8);
    small->values.limited = 3;
    small->values.with_sign = -7;
    small->values.count = 3;
    small->values.wide_constant = INT64_MIN + 1;
    memcpy(small->values.text, "hello, world", 12);
    od_init(&small->od, &table, &small->values, &hooks, small);
}
