/* SPDX-License-Identifier: MIT */
/* Uploads that break off, are refused or do not fit leave the active program whole. Run by `make unit`; no I/O. */
#include "app/program_slot.h"

#include <string.h>

#include "app_image.h"
#include "core/kernel.h"
#include "fake_port.h"
#include "unity.h"

static const struct config config = {
    .period_us = 1000,
    .feed_limit_um_s = 20000,
    .acceleration_limit_um_s2 = 200000,
    .jerk_limit_mm_s3 = 8000,
    .counts_per_mm = 1000000,
    .axis_count = 2,
    .travel = {{-100000000, 100000000}, {-100000000, 100000000}},
    .crc32 = 1,
};
static struct program_slot slot;
static uint8_t image[APP_IMAGE_SIZE];

void setUp(void)
{
    fake_port_reset();
    program_slot_init(&slot);
    app_image_make(image, 10, 20);
}

void tearDown(void)
{
}

static int upload(void)
{
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, sizeof image));
    for (uint32_t k = 0; k < sizeof image; k += 8u) {
        TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, k, &image[k], 8));
    }
    return program_slot_finish(&slot, sizeof image, &config);
}

static void count_call(void *self)
{
    unsigned *calls = self;
    (*calls)++;
}

static void expect_active(const uint8_t *expected)
{
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_READY, program_slot_state(&slot));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, slot.program.image, APP_IMAGE_SIZE);
}

static void test_a_check_lets_the_main_loop_give_signs_of_life(void)
{
    struct config limited = config;
    unsigned calls = 0;
    limited.axis[0].velocity_limit_um_s = 20000;
    slot.user.attend = count_call;
    slot.user.self = &calls;
    TEST_ASSERT_EQUAL_INT(0, upload());
    /* segment, piece, its stops of both kinds, no limits of axes; records of a segment and a piece */
    TEST_ASSERT_EQUAL_UINT(4 + 2, calls);
    limited.crc32++;
    program_slot_refresh(&slot, &limited);
    TEST_ASSERT_TRUE(slot.acceptable);
    TEST_ASSERT_EQUAL_UINT(4 + 2 + 5, calls);
}

/* The longest piece of work of the store without a sign of life, in bytes. */
static struct {
    uint32_t bytes;
    uint32_t most;
} silent;

static void note_life(void *self)
{
    (void)self;
    silent.bytes = 0;
}

static uint8_t memory[PORT_STORE_BANKS][4096];

static uint32_t memory_size(unsigned bank)
{
    return sizeof memory[bank];
}

static int memory_erase(unsigned bank)
{
    memset(memory[bank], 0xFF, sizeof memory[bank]);
    return 0;
}

static int memory_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    memcpy(&memory[bank][offset], data, size);
    silent.bytes += size;
    silent.most = silent.bytes > silent.most ? silent.bytes : silent.most;
    return 0;
}

static const uint8_t *memory_data(unsigned bank)
{
    return memory[bank];
}

/* A board writes 100 KB in more than two seconds, after which drives that are on miss the heartbeat. */
static void test_writing_lets_the_main_loop_give_signs_of_life(void)
{
    static const struct fake_port_store store = {memory_size, memory_erase, memory_write,
                                                 memory_data};
    struct config other = config;
    fake_port_use_store(&store);
    slot.user.attend = note_life;
    other.kernel = 1;
    other.crc32 = 2;
    TEST_ASSERT_EQUAL_INT(0, upload());
    silent.bytes = 0;
    silent.most = 0;
    program_slot_refresh(&slot, &other);
    fake_port_use_store(NULL);
    TEST_ASSERT_TRUE(slot.acceptable);
    TEST_ASSERT_TRUE(silent.most > 0u);
    TEST_ASSERT_TRUE(silent.most <= 300u);
}

static void test_a_good_image_becomes_the_program(void)
{
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    TEST_ASSERT_EQUAL_INT(0, upload());
    expect_active(image);
    TEST_ASSERT_TRUE(slot.acceptable);
    TEST_ASSERT_EQUAL_INT32(10000000, slot.start_counts[0]);
    TEST_ASSERT_EQUAL_INT32(14000000, slot.end_counts[0]);
    TEST_ASSERT_EQUAL_INT32(20000000, slot.end_counts[1]);
}

/* At every byte: the old program is whole, and the next upload works. */
static void test_an_upload_may_break_off_anywhere(void)
{
    static uint8_t first[APP_IMAGE_SIZE];
    TEST_ASSERT_EQUAL_INT(0, upload());
    memcpy(first, image, sizeof first);
    app_image_make(image, -10, 0);
    for (uint32_t length = 0; length < sizeof image; ++length) {
        TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, sizeof image));
        TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_RECEIVING, program_slot_state(&slot));
        TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, 0, image, length));
        program_slot_abandon(&slot);
        expect_active(first);
    }
    TEST_ASSERT_EQUAL_INT(0, upload());
    expect_active(image);
}

static void test_a_truncated_image_is_refused_though_the_bank_holds_more(void)
{
    TEST_ASSERT_EQUAL_INT(0, upload());
    const unsigned bank = slot.bank;
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, 0));
    TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, 0, image, sizeof image));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_slot_finish(&slot, sizeof image - 1u, &config));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_slot_finish(&slot, sizeof image + 1u, &config));
    TEST_ASSERT_EQUAL_UINT(bank, slot.bank);
    expect_active(image);
}

static void test_a_refusal_names_error_and_place(void)
{
    image[200 + 28] = 1; /* c2 of piece 0 is 2^-8 mm: it does not begin at rest */
    app_image_seal(image);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_START_MOVING, upload());
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_START_MOVING, slot.refused.code);
    TEST_ASSERT_EQUAL_UINT32(0, slot.refused.index);
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    app_image_make(image, 10, 20);
    TEST_ASSERT_EQUAL_INT(0, upload());
    TEST_ASSERT_EQUAL_INT(0, slot.refused.code);
}

static void test_what_the_store_cannot_take(void)
{
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE, program_slot_begin(&slot, FAKE_PORT_BANK_BYTES + 1u));
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, 0));
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE,
                          program_slot_write(&slot, FAKE_PORT_BANK_BYTES - 7u, image, 8));
    fake_port_fail_store(true);
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE, program_slot_write(&slot, 0, image, 8));
}

static void test_a_new_configuration_is_applied_to_the_old_program(void)
{
    struct config other = config;
    TEST_ASSERT_EQUAL_INT(0, upload());
    other.jerk_limit_mm_s3 = 1900;
    other.counts_per_mm = 1000;
    other.travel[0].max_counts = 100000;
    other.travel[1].max_counts = 100000;
    program_slot_refresh(&slot, &other);
    TEST_ASSERT_TRUE_MESSAGE(slot.acceptable, "its CRC says that it is the same");
    other.crc32 = 2;
    program_slot_refresh(&slot, &other);
    TEST_ASSERT_FALSE(slot.acceptable);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_JERK, slot.refused.code);
    TEST_ASSERT_EQUAL_INT32(10000, slot.start_counts[0]);
}

static void test_the_records_are_those_of_the_kernel(void)
{
    struct config other = config;
    TEST_ASSERT_EQUAL_INT(0, upload());
    const unsigned bank = slot.bank;
    TEST_ASSERT_EQUAL_PTR(kernel_find(0), slot.program.coefficients_for);
    other.kernel = 1;
    other.crc32 = 2;
    program_slot_refresh(&slot, &other);
    TEST_ASSERT_TRUE(slot.acceptable);
    TEST_ASSERT_EQUAL_PTR(kernel_find(1), slot.program.coefficients_for);
    TEST_ASSERT_EQUAL_UINT(1u - bank, slot.bank);
    expect_active(image);
    fake_port_fail_store(true);
    program_slot_refresh(&slot, &config);
    TEST_ASSERT_FALSE(slot.acceptable);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_STORE, slot.refused.code);
}

static void test_no_room_for_the_records(void)
{
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, sizeof image));
    TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, 0, image, sizeof image));
    fake_port_shrink_store(sizeof image + 200u);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_ROOM, program_slot_finish(&slot, sizeof image, &config));
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
}

static void power_on(void)
{
    program_slot_init(&slot);
    program_slot_recover(&slot);
    program_slot_refresh(&slot, &config);
}

static void test_after_power_on_the_newest_program_is_there(void)
{
    static uint8_t first[APP_IMAGE_SIZE];
    power_on();
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    for (int32_t x = 0; x < 5; ++x) {
        memcpy(first, image, sizeof first);
        app_image_make(image, x, 20);
        TEST_ASSERT_EQUAL_INT(0, upload());
        power_on();
        expect_active(image);
        TEST_ASSERT_TRUE(slot.acceptable);
        TEST_ASSERT_EQUAL_INT(0, slot.refused.code);
        TEST_ASSERT_EQUAL_PTR(kernel_find(0), slot.program.coefficients_for);
        TEST_ASSERT_EQUAL_INT32(x * 1000000, slot.start_counts[0]);
    }
    const unsigned bank = slot.bank;
    fake_port_spoil_store(bank, 48); /* for information only: nothing but the CRC sees it */
    power_on();
    expect_active(first);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CRC,
                          slot.refused.code); /* the operator expects the newer one */
    fake_port_spoil_store(1u - bank, FAKE_PORT_BANK_BYTES - 9u);
    power_on();
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CRC, slot.refused.code);
    TEST_ASSERT_EQUAL_INT(0, upload());
}

/* The older program of the two is spoiled, in either bank: nobody misses it. */
static void test_a_spoiled_older_program_is_not_reported(void)
{
    for (int32_t uploads = 2; uploads <= 3; ++uploads) {
        setUp();
        for (int32_t x = 0; x < uploads; ++x) {
            app_image_make(image, x, 20);
            TEST_ASSERT_EQUAL_INT(0, upload());
        }
        fake_port_spoil_store(1u - slot.bank, 48);
        power_on();
        expect_active(image);
        TEST_ASSERT_EQUAL_INT(0, slot.refused.code);
    }
}

/* A firmware with stricter rules refuses the newer program of two, or both; then the first one is back. */
static void test_an_upload_is_the_newest_for_each_firmware(void)
{
    for (unsigned refused = 1; refused <= 2u; ++refused) {
        setUp();
        for (int32_t x = 0; x < 4; ++x) {
            app_image_make(image, x, 20);
            TEST_ASSERT_EQUAL_INT(0, upload());
        }
        const unsigned banks[2] = {slot.bank, 1u - slot.bank};
        for (unsigned i = 0; i < refused; ++i) {
            fake_port_spoil_store(banks[i], 48);
        }
        power_on();
        app_image_make(image, 9, 20);
        TEST_ASSERT_EQUAL_INT(0, upload());
        for (unsigned i = 0; i < refused; ++i) {
            if (banks[i] != slot.bank) {
                fake_port_spoil_store(banks[i], 48);
            }
        }
        power_on();
        expect_active(image);
    }
}

static void test_a_program_without_its_record_is_refused(void)
{
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, sizeof image));
    TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, 0, image, sizeof image));
    power_on();
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, sizeof image));
    TEST_ASSERT_EQUAL_INT(0, program_slot_write(&slot, 0, image, sizeof image));
    fake_port_fail_store(true);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_STORE, program_slot_finish(&slot, sizeof image, &config));
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_NONE, program_slot_state(&slot));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_good_image_becomes_the_program);
    RUN_TEST(test_a_check_lets_the_main_loop_give_signs_of_life);
    RUN_TEST(test_writing_lets_the_main_loop_give_signs_of_life);
    RUN_TEST(test_an_upload_may_break_off_anywhere);
    RUN_TEST(test_a_truncated_image_is_refused_though_the_bank_holds_more);
    RUN_TEST(test_a_refusal_names_error_and_place);
    RUN_TEST(test_what_the_store_cannot_take);
    RUN_TEST(test_a_new_configuration_is_applied_to_the_old_program);
    RUN_TEST(test_the_records_are_those_of_the_kernel);
    RUN_TEST(test_no_room_for_the_records);
    RUN_TEST(test_after_power_on_the_newest_program_is_there);
    RUN_TEST(test_a_spoiled_older_program_is_not_reported);
    RUN_TEST(test_an_upload_is_the_newest_for_each_firmware);
    RUN_TEST(test_a_program_without_its_record_is_refused);
    return UNITY_END();
}
