/* SPDX-License-Identifier: MIT */
/* The table of handlers against the dictionary: a value with a handler is computed for every entry of the row. Run
 * by `make unit`; no I/O. */
#include "app/objects.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "unity.h"

#define STALE UINT64_C(0x5A5A5A5A5A5A5A5A) /* no object ever has this value */

static struct app_bench bench;

void setUp(void)
{
    app_bench_init(&bench, 10000000, -5000000);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
}

void tearDown(void)
{
}

static bool is_number(const struct od_entry *entry)
{
    return entry->type != OD_DOMAIN && entry->type != OD_VISIBLE_STRING &&
           entry->type != OD_OCTET_STRING;
}

/* Whether the entry still has a stale value after a read from the bus. */
static bool reads_stale(const struct od_entry *entry)
{
    struct od *od = &bench.controller.od;
    uint8_t bytes[8];
    uint32_t size;
    od_set_number(od, entry, STALE);
    const uint64_t stale = od_number(od, entry);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, od_read(od, entry, bytes, sizeof bytes, &size));
    return od_number(od, entry) == stale;
}

/* Nobody can write these, and nothing else fills their fields. */
static void test_every_read_only_object_of_the_machine_is_computed(void)
{
    const struct od_table *table = bench.controller.od.table;
    unsigned seen = 0;
    for (uint16_t i = 0; i < table->entry_count; ++i) {
        const struct od_entry *entry = &table->entries[i];
        const bool member = entry->sub > 0u || entry->index == 0x2002u || entry->index == 0x2040u;
        if (entry->index >= OD_FIRST_MANUFACTURER && entry->access == OD_READ && member &&
            is_number(entry)) {
            TEST_ASSERT_FALSE_MESSAGE(reads_stale(entry), "an object without a reader");
            seen++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(100, seen);
}

/* A reader after a value that the host writes would give back another one. */
static void test_what_the_host_wrote_is_read_back(void)
{
    const struct od_table *table = bench.controller.od.table;
    unsigned seen = 0;
    for (uint16_t i = 0; i < table->entry_count; ++i) {
        const struct od_entry *entry = &table->entries[i];
        const bool own = entry->index == 0x2010u || entry->index == 0x2050u ||
                         entry->index == 0x2058u || entry->index == 0x2060u;
        if (entry->index >= OD_FIRST_MANUFACTURER && !own && is_number(entry) &&
            (entry->access & (OD_READ | OD_WRITE)) == (OD_READ | OD_WRITE)) {
            TEST_ASSERT_TRUE_MESSAGE(reads_stale(entry), "a written object has a reader");
            seen++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(100, seen);
}

static void test_pdo_parameters_follow_the_configuration(void)
{
    for (uint16_t axis = 0; axis < AXES_MAX; ++axis) {
        const uint16_t parameters[] = {(uint16_t)(0x1400u + axis), (uint16_t)(0x1800u + axis),
                                       (uint16_t)(0x1806u + axis)};
        for (unsigned i = 0; i < sizeof parameters / sizeof parameters[0]; ++i) {
            TEST_ASSERT_FALSE(reads_stale(od_find(&bench.controller.od, parameters[i], 1)));
            TEST_ASSERT_TRUE(reads_stale(od_find(&bench.controller.od, parameters[i], 2)));
        }
        const uint16_t setpoint = (uint16_t)(0x1A00u + axis);
        const uint16_t velocity = (uint16_t)(0x1A06u + axis);
        TEST_ASSERT_FALSE(reads_stale(od_find(&bench.controller.od, setpoint, 0)));
        TEST_ASSERT_TRUE(reads_stale(od_find(&bench.controller.od, setpoint, 1)));
        TEST_ASSERT_TRUE(reads_stale(od_find(&bench.controller.od, setpoint, 2)));
        TEST_ASSERT_FALSE(reads_stale(od_find(&bench.controller.od, setpoint, 3)));
        TEST_ASSERT_FALSE(reads_stale(od_find(&bench.controller.od, velocity, 0)));
        TEST_ASSERT_FALSE(reads_stale(od_find(&bench.controller.od, velocity, 1)));
    }
}

static void test_stops_alone_are_urgent(void)
{
    const struct od_entry *command = od_find(&bench.controller.od, 0x2001, 0);
    const struct od_entry *state = od_find(&bench.controller.od, 0x2011, 0);
    for (unsigned value = 0; value <= 255u; ++value) {
        const bool stops = value == 3u || value == 6u || value == 9u;
        TEST_ASSERT_EQUAL(stops, objects_hooks.urgent(command, (uint8_t)value));
        TEST_ASSERT_FALSE(objects_hooks.urgent(state, (uint8_t)value));
    }
}

static void test_a_wrong_signature_neither_stores_nor_restores(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TRANSFER, app_bench_write(&bench, 0x1010, 1, 0x64616F6C, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TRANSFER, app_bench_write(&bench, 0x1011, 1, 0x65766173, 4));
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x1010, 1));
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x1011, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1010, 1, 0x65766173, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1011, 1, 0x64616F6C, 4));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_read_only_object_of_the_machine_is_computed);
    RUN_TEST(test_what_the_host_wrote_is_read_back);
    RUN_TEST(test_pdo_parameters_follow_the_configuration);
    RUN_TEST(test_stops_alone_are_urgent);
    RUN_TEST(test_a_wrong_signature_neither_stores_nor_restores);
    return UNITY_END();
}
