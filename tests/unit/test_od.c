/* SPDX-License-Identifier: MIT */
/* Tests of canopen/od.h: an object dictionary. Run by `make unit`. Changes its own dictionary only (small_od.h). */
#include "canopen/od.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "small_od.h"
#include "unity.h"

static struct small_od small;

void setUp(void)
{
    small_od_init(&small);
}

void tearDown(void)
{
}

static uint32_t write_number(uint16_t index, uint8_t sub, uint64_t value, uint32_t size)
{
    uint8_t bytes[16] = {0};
    const struct od_entry *entry = od_find(&small.od, index, sub);

    TEST_ASSERT_NOT_NULL(entry);
    cob_put(bytes, value, size < 8 ? size : 8);
    return od_write(&small.od, entry, bytes, size);
}

static void test_finds_every_entry_and_no_other(void)
{
    const struct od_table *table = small.od.table;

    for (uint16_t i = 0; i < table->entry_count; i++) {
        const struct od_entry *entry = &table->entries[i];
        TEST_ASSERT_EQUAL_PTR(entry, od_find(&small.od, entry->index, entry->sub));
    }
    TEST_ASSERT_NULL(od_find(&small.od, 0x0000, 0));
    TEST_ASSERT_NULL(od_find(&small.od, 0x2004, 2));
    TEST_ASSERT_NULL(od_find(&small.od, 0xFFFF, 0xFF));
}

static void test_reports_what_is_missing(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, od_missing(&small.od, 0x1001, 0));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, od_missing(&small.od, 0xFFFF, 0));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_SUB, od_missing(&small.od, 0x2004, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_SUB, od_missing(&small.od, 0x2003, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, od_missing(&small.od, 0x2004, 3));
}

static void test_reads_numbers_little_endian(void)
{
    uint8_t bytes[8];
    uint32_t size = 0;
    const uint8_t word[4] = {0x78, 0x56, 0x34, 0x12};
    const uint8_t minus_seven[2] = {0xF9, 0xFF};

    TEST_ASSERT_EQUAL_HEX32(
        SDO_OK, od_read(&small.od, od_find(&small.od, 0x1000, 0), bytes, sizeof bytes, &size));
    TEST_ASSERT_EQUAL_UINT32(4, size);
    TEST_ASSERT_EQUAL_MEMORY(word, bytes, 4);
    TEST_ASSERT_EQUAL_HEX32(
        SDO_OK, od_read(&small.od, od_find(&small.od, 0x2001, 0), bytes, sizeof bytes, &size));
    TEST_ASSERT_EQUAL_UINT32(2, size);
    TEST_ASSERT_EQUAL_MEMORY(minus_seven, bytes, 2);
}

static void test_reads_strings_without_their_padding(void)
{
    uint8_t bytes[SMALL_DOMAIN_MAX];
    uint32_t size = 0;

    od_read(&small.od, od_find(&small.od, 0x2006, 0), bytes, sizeof bytes, &size);
    TEST_ASSERT_EQUAL_UINT32(12, size);
    TEST_ASSERT_EQUAL_MEMORY("hello, world", bytes, 12);
    od_read(&small.od, od_find(&small.od, 0x1008, 0), bytes, sizeof bytes, &size);
    TEST_ASSERT_EQUAL_UINT32(8, size);
}

static void test_refuses_reads(void)
{
    uint8_t bytes[8];
    uint32_t size;

    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_WRITE_ONLY, od_read(&small.od, od_find(&small.od, 0x2002, 0),
                                                          bytes, sizeof bytes, &size));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_MEMORY,
                            od_read(&small.od, od_find(&small.od, 0x1000, 0), bytes, 3, &size));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_ACCESS, od_read(&small.od, od_find(&small.od, 0x2005, 0),
                                                      bytes, sizeof bytes, &size));
    small.read_refusal = SDO_ABORT_NO_DATA;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_DATA, od_read(&small.od, od_find(&small.od, 0x1000, 0),
                                                       bytes, sizeof bytes, &size));
}

static void test_computes_on_read(void)
{
    uint8_t bytes[4];
    uint32_t size;
    const struct od_entry *entry = od_find(&small.od, 0x2009, 0);

    od_read(&small.od, entry, bytes, sizeof bytes, &size);
    od_read(&small.od, entry, bytes, sizeof bytes, &size);
    TEST_ASSERT_EQUAL_UINT32(2, bytes[0]);
}

static void test_writes_numbers_of_all_sizes(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, write_number(0x2000, 0, 5, 1));
    TEST_ASSERT_EQUAL_UINT8(5, small.values.limited);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, write_number(0x2001, 0, (uint64_t)-100, 2));
    TEST_ASSERT_EQUAL_INT16(-100, small.values.with_sign);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, write_number(0x2003, 0, 0xFFFFFFFF, 4));
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFF, small.values.word);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, write_number(0x2004, 1, UINT64_MAX - 1, 8));
    TEST_ASSERT_EQUAL_HEX64(UINT64_MAX - 1, small.values.wide);
    TEST_ASSERT_EQUAL_INT(4, small.written);
}

static void test_refuses_writes_and_changes_nothing(void)
{
    struct small_values before = small.values;

    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_READ_ONLY, write_number(0x1000, 0, 1, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_LONG, write_number(0x2003, 0, 1, 5));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_SHORT, write_number(0x2003, 0, 1, 3));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, write_number(0x2000, 0, 6, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_LOW, write_number(0x2000, 0, 0, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, write_number(0x2001, 0, 101, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_LOW, write_number(0x2001, 0, (uint64_t)-101, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, write_number(0x2007, 0, 2, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_ACCESS, write_number(0x2005, 0, 2, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_SHORT, write_number(0x2008, 0, 2, 4));
    small.veto = SDO_ABORT_STATE;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, write_number(0x2003, 0, 1, 4));
    TEST_ASSERT_EQUAL_MEMORY(&before, &small.values, sizeof before);
    TEST_ASSERT_EQUAL_INT(0, small.written);
}

static void test_a_shorter_string_replaces_a_longer_one_whole(void)
{
    uint8_t bytes[32];
    uint32_t size;
    const struct od_entry *entry = od_find(&small.od, 0x2006, 0);

    TEST_ASSERT_EQUAL_HEX32(SDO_OK, od_write(&small.od, entry, (const uint8_t *)"bye", 3));
    od_read(&small.od, entry, bytes, sizeof bytes, &size);
    TEST_ASSERT_EQUAL_UINT32(3, size);
    TEST_ASSERT_EQUAL_MEMORY("bye", bytes, 3);
    TEST_ASSERT_EQUAL_HEX32(
        SDO_OK, od_write(&small.od, entry, (const uint8_t *)"exactly twenty bytes", 20));
    TEST_ASSERT_EQUAL_UINT32(20, od_size(&small.od, entry));
    TEST_ASSERT_EQUAL_HEX32(
        SDO_ABORT_TOO_LONG,
        od_write(&small.od, entry, (const uint8_t *)"one byte too many....", 21));
}

static void test_works_without_hooks(void)
{
    uint8_t bytes[8];
    uint32_t size;
    const uint8_t two[1] = {2};

    od_init(&small.od, small.od.table, &small.values, NULL, NULL);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                            od_write(&small.od, od_find(&small.od, 0x2000, 0), two, sizeof two));
    TEST_ASSERT_EQUAL_HEX32(
        SDO_OK, od_read(&small.od, od_find(&small.od, 0x2000, 0), bytes, sizeof bytes, &size));
    TEST_ASSERT_EQUAL_UINT8(2, bytes[0]);
}

static void test_reads_twos_complement(void)
{
    TEST_ASSERT_EQUAL_INT64(-1, cob_signed(0xFF, 1));
    TEST_ASSERT_EQUAL_INT64(-128, cob_signed(0x80, 1));
    TEST_ASSERT_EQUAL_INT64(127, cob_signed(0x7F, 1));
    TEST_ASSERT_EQUAL_INT64(INT32_MIN, cob_signed(0x80000000u, 4));
    TEST_ASSERT_EQUAL_INT64(INT64_MIN, cob_signed(UINT64_C(1) << 63, 8));
    TEST_ASSERT_EQUAL_INT64(-1, cob_signed(UINT64_MAX, 8));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_finds_every_entry_and_no_other);
    RUN_TEST(test_reports_what_is_missing);
    RUN_TEST(test_reads_numbers_little_endian);
    RUN_TEST(test_reads_strings_without_their_padding);
    RUN_TEST(test_refuses_reads);
    RUN_TEST(test_computes_on_read);
    RUN_TEST(test_writes_numbers_of_all_sizes);
    RUN_TEST(test_refuses_writes_and_changes_nothing);
    RUN_TEST(test_a_shorter_string_replaces_a_longer_one_whole);
    RUN_TEST(test_works_without_hooks);
    RUN_TEST(test_reads_twos_complement);
    return UNITY_END();
}
