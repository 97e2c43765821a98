/* SPDX-License-Identifier: MIT */
/* The program store on a model of the flash: every rule of the chip kept, and the power cut at every operation. Run
 * by `make unit`; reads files of tests/data. */
#include "port/stm32g4/flash_store.h"

#include <stdlib.h>
#include <string.h>

#include "app/parameter_store.h"
#include "app/program_slot.h"
#include "core/crc32.h"
#include "core/interpolator.h"
#include "core/override_plan.h"
#include "fake_port.h"
#include "flash_model.h"
#include "golden.h"
#include "od_controller.h"
#include "port/stm32g4/flash.h"
#include "stm32g4_chip.h"
#include "unity.h"

#define PAGE  2048u
#define CHUNK 889u /* what a block of SDO brings: 127 segments of 7 bytes */

/* Under the sanitizers a part of the operations only; the build without them takes them all. */
#if defined(__SANITIZE_ADDRESS__)
#define STRIDE  37u
#define REPEATS 50u
#else
#define STRIDE  1u
#define REPEATS 400u
#endif

enum { ELDER, OLD, NEW, IMAGES };

static const struct config config = {
    .period_us = 1000,
    .counts_per_mm = 1000000,
    .axis_count = 2,
    .travel = {{-1000000000, 1000000000}, {-1000000000, 1000000000}},
};
/* The elder one is the longest, so that a part of it would be left where a page is not erased. */
static const char *const names[IMAGES] = {"star_minimax.hdgp", "alpha_minimax.hdgp",
                                          "heart_minimax.hdgp"};
static struct image {
    uint8_t *bytes;
    uint32_t size;
    uint32_t setpoints_crc;
} images[IMAGES];
static struct program_slot slot;

static int erase(unsigned bank)
{
    return flash_store_erase(bank) ? 0 : PORT_ERR_STORE;
}

static int write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    return flash_store_write(bank, offset, data, size) ? 0 : PORT_ERR_STORE;
}

static const struct fake_port_store store = {
    .size = flash_store_size, .erase = erase, .write = write, .data = flash_store_data};

void setUp(void)
{
    fake_port_reset();
    fake_port_use_store(&store);
    flash_model_new();
    chip_power_on();
}

void tearDown(void)
{
}

/* --- the chip's rules --- */

static void test_a_page_and_a_double_word(void)
{
    static const uint8_t word[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    TEST_ASSERT_TRUE(flash_is_dual());
    TEST_ASSERT_TRUE(flash_program(5u * PAGE + 16u, word));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(word, flash_model_memory(0x08040000u + 5u * PAGE + 16u), 8);
    TEST_ASSERT_FALSE_MESSAGE(flash_program(5u * PAGE + 16u, word), "programmed twice");
    TEST_ASSERT_TRUE(flash_erase_page(5));
    TEST_ASSERT_EQUAL_UINT(1, flash_model_erased(5));
    TEST_ASSERT_TRUE(flash_program(5u * PAGE + 16u, word));
    TEST_ASSERT_FALSE(flash_program(5u * PAGE + 20u, word));
    TEST_ASSERT_FALSE(flash_program(FLASH_MODEL_BYTES, word));
    TEST_ASSERT_FALSE(flash_erase_page(FLASH_PAGES));
    TEST_ASSERT_TRUE(flash_erase_page(FLASH_PAGES - 1u));
}

static void test_nothing_stale_stays_in_the_cache(void)
{
    static const uint8_t word[8] = {0};
    TEST_ASSERT_TRUE(flash_program(0, word));
    TEST_ASSERT_FALSE(flash_model_cache_is_stale());
    TEST_ASSERT_TRUE(flash_erase_page(0));
    TEST_ASSERT_FALSE(flash_model_cache_is_stale());
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0x600, flash_model_read(0x40022000u), "caches are on again");
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0x80000000u, flash_model_read(0x40022014u), "locked again");
}

static void test_errors_of_the_chip_are_reported_and_do_not_stay(void)
{
    static const uint8_t word[8] = {0};
    flash_model_refuse_next();
    TEST_ASSERT_FALSE(flash_program(0, word));
    TEST_ASSERT_TRUE(flash_program(0, word));
    flash_model_refuse_next();
    TEST_ASSERT_FALSE(flash_erase_page(0));
    TEST_ASSERT_TRUE(flash_erase_page(0));
}

static void test_words_that_cannot_be_corrected(void)
{
    TEST_ASSERT_FALSE(flash_take_ecc_error());
    flash_model_fail_word(2);
    TEST_ASSERT_TRUE(flash_take_ecc_error());
    TEST_ASSERT_FALSE_MESSAGE(flash_take_ecc_error(), "the flag is still set");
    flash_model_power_on();
    flash_model_fail_word(1);
    TEST_ASSERT_FALSE_MESSAGE(flash_take_ecc_error(), "the bank that the code is in");
    flash_model_single_bank();
    TEST_ASSERT_FALSE(flash_is_dual());
}

/* --- the store --- */

static void test_a_bank_takes_pieces_of_any_size(void)
{
    static uint8_t data[FLASH_STORE_BYTES];
    uint64_t random = 3;
    for (uint32_t i = 0; i < sizeof data; ++i) {
        data[i] = (uint8_t)golden_random(&random);
    }
    for (unsigned bank = 0; bank < PORT_STORE_BANKS; ++bank) {
        TEST_ASSERT_TRUE(flash_store_erase(bank));
        for (uint32_t at = 0; at < sizeof data;) {
            uint32_t size = (uint32_t)(golden_random(&random) % 900u);
            size = size < sizeof data - at ? size : (uint32_t)sizeof data - at;
            TEST_ASSERT_TRUE(flash_store_write(bank, at, data + at, size));
            at += size;
        }
    }
    TEST_ASSERT_EQUAL_INT(0, memcmp(data, flash_store_data(0), sizeof data));
    TEST_ASSERT_EQUAL_INT(0, memcmp(data, flash_store_data(1), sizeof data));
    for (uint32_t page = 0; page < FLASH_PAGES; ++page) {
        TEST_ASSERT_EQUAL_UINT(page < 126u ? 1 : 0, flash_model_erased(page));
    }
}

static void test_erasing_takes_one_page_only(void)
{
    TEST_ASSERT_TRUE(flash_store_erase(0));
    TEST_ASSERT_TRUE(flash_store_erase(1));
    TEST_ASSERT_TRUE(flash_store_erase(2));
    TEST_ASSERT_TRUE(flash_store_erase(3));
    TEST_ASSERT_EQUAL_UINT32(4, flash_model_operations());
    TEST_ASSERT_EQUAL_UINT(1, flash_model_erased(62));
    for (uint32_t page = 125; page < FLASH_PAGES; ++page) {
        TEST_ASSERT_EQUAL_UINT(1, flash_model_erased(page));
    }
}

static void test_a_gap_may_lead_into_the_last_page_only(void)
{
    static const uint8_t data[16] = {9, 8, 7, 6, 5, 4, 3, 2, 1};
    static const uint8_t filled[8] = {9, 8, 7, 6, 5, 0xFF, 0xFF, 0xFF};
    TEST_ASSERT_TRUE(flash_store_erase(1));
    TEST_ASSERT_TRUE(flash_store_write(1, 0, data, 5));
    TEST_ASSERT_TRUE(flash_store_write(1, FLASH_STORE_BYTES - 16u, data, 16));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(filled, flash_store_data(1), 8);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, flash_store_data(1) + FLASH_STORE_BYTES - 16u, 16);
    TEST_ASSERT_TRUE(flash_store_erase(1));
    TEST_ASSERT_FALSE(flash_store_write(1, PAGE, data, 8));
    TEST_ASSERT_FALSE_MESSAGE(flash_store_write(1, 0, data, 8), "a failed bank takes no more");
}

static void test_what_the_store_refuses(void)
{
    static const uint8_t data[16] = {0};
    TEST_ASSERT_EQUAL_UINT32(0, flash_store_size(FLASH_STORE_BANKS));
    TEST_ASSERT_FALSE(flash_store_erase(FLASH_STORE_BANKS));
    TEST_ASSERT_FALSE(flash_store_write(0, 0, data, 8));
    TEST_ASSERT_TRUE(flash_store_erase(0));
    TEST_ASSERT_FALSE_MESSAGE(flash_store_write(1, 0, data, 8), "not the bank that was erased");
    TEST_ASSERT_TRUE(flash_store_erase(0));
    TEST_ASSERT_TRUE(flash_store_write(0, 0, data, 16));
    TEST_ASSERT_FALSE_MESSAGE(flash_store_write(0, 8, data, 8), "written already");
    TEST_ASSERT_TRUE(flash_store_erase(0));
    TEST_ASSERT_FALSE(flash_store_write(0, FLASH_STORE_BYTES - 8u, data, 16));
    flash_model_refuse_next();
    TEST_ASSERT_FALSE(flash_store_erase(0));
    TEST_ASSERT_FALSE(flash_store_write(0, 0, data, 8));
}

/* --- power --- */

static uint32_t run(const struct program *program)
{
    static struct interpolator interp;
    struct golden_precomputed precomputed;
    uint32_t crc = 0;
    const uint32_t ticks = program_ticks(program);
    golden_precompute(&precomputed, program, KERNEL_FIXED);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&interp, &precomputed.program));
    for (uint32_t k = 0; k < ticks; ++k) {
        struct interpolator_point point;
        const uint64_t time_q32_s = ((uint64_t)k << 32) / 1000u;
        TEST_ASSERT_TRUE(interpolator_at(&interp, time_q32_s, &point) >= 0);
        crc = crc32_update(crc, (const uint8_t *)&point.position_q40[0],
                           sizeof point.position_q40[0]);
        crc = crc32_update(crc, (const uint8_t *)&point.position_q40[1],
                           sizeof point.position_q40[1]);
    }
    golden_discard(&precomputed);
    return crc;
}

static void load_images(void)
{
    for (unsigned i = 0; i < IMAGES; ++i) {
        struct program program;
        images[i].bytes = golden_load(names[i], &images[i].size);
        TEST_ASSERT_NOT_NULL(images[i].bytes);
        TEST_ASSERT_EQUAL_INT(0, program_open(&program, images[i].bytes, images[i].size));
        images[i].setpoints_crc = run(&program);
    }
}

static void free_images(void)
{
    for (unsigned i = 0; i < IMAGES; ++i) {
        free(images[i].bytes);
    }
}

static void upload(unsigned which)
{
    const struct image *image = &images[which];
    TEST_ASSERT_EQUAL_INT(0, program_slot_begin(&slot, image->size));
    for (uint32_t at = 0; at < image->size; at += CHUNK) {
        const uint32_t left = image->size - at;
        TEST_ASSERT_EQUAL_INT(
            0, program_slot_write(&slot, at, image->bytes + at, left < CHUNK ? left : CHUNK));
    }
    TEST_ASSERT_EQUAL_INT(0, program_slot_finish(&slot, image->size, &config));
}

static void boot(void)
{
    chip_power_on();
    program_slot_init(&slot);
    program_slot_recover(&slot);
    program_slot_refresh(&slot, &config);
}

static bool is_active(unsigned which)
{
    return slot.program.size == images[which].size &&
           memcmp(slot.program.image, images[which].bytes, images[which].size) == 0;
}

static void expect_whole(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(PROGRAM_SLOT_READY, program_slot_state(&slot), "no program");
    TEST_ASSERT_TRUE_MESSAGE(slot.acceptable, "a program that may not run");
    TEST_ASSERT_TRUE_MESSAGE(is_active(OLD) || is_active(NEW), "neither the old nor the new one");
}

/* The store as it is in use: the elder program's bank is about to take the new one. */
static void prepare(void)
{
    flash_model_new();
    boot();
    upload(ELDER);
    upload(OLD);
    boot();
    TEST_ASSERT_TRUE(is_active(OLD));
    flash_model_save();
}

static void come_back(void)
{
    flash_model_restore();
    boot();
}

static jmp_buf power;

/* True: the power held out. */
static bool upload_until(uint32_t operation, enum flash_model_remains remains, uint32_t seed)
{
    flash_model_cut(flash_model_operations() + operation, remains, seed, &power);
    if (setjmp(power) == 0) {
        upload(NEW);
        flash_model_cut(UINT32_MAX, FLASH_MODEL_AFTER, 0, NULL);
        return true;
    }
    return false;
}

/* How many operations an upload has. */
static uint32_t count_operations(void)
{
    prepare();
    const uint32_t before = flash_model_operations();
    TEST_ASSERT_TRUE(upload_until(100000, FLASH_MODEL_AFTER, 0));
    return flash_model_operations() - before;
}

static void cut_at(uint32_t operation, uint32_t last, enum flash_model_remains remains)
{
    come_back();
    TEST_ASSERT_FALSE(upload_until(operation, remains, operation));
    boot();
    expect_whole();
    if (operation < last || remains == FLASH_MODEL_BEFORE) {
        TEST_ASSERT_TRUE_MESSAGE(is_active(OLD), "the new program is not complete");
    } else if (remains == FLASH_MODEL_AFTER) {
        TEST_ASSERT_TRUE_MESSAGE(is_active(NEW), "the new program is complete");
    }
}

static void test_power_lost_at_any_operation_leaves_a_whole_program(void)
{
    load_images();
    const uint32_t operations = count_operations();
    /* a double word for eight bytes of the program and more, after it, that it is made ready with */
    TEST_ASSERT_TRUE(operations > images[NEW].size / 8u);
    for (uint32_t operation = 0; operation < operations; operation += STRIDE) {
        for (int remains = 0; remains < FLASH_MODEL_REMAINS; ++remains) {
            cut_at(operation, operations - 1u, (enum flash_model_remains)remains);
        }
        if (operation % 64u == 0u) {
            const unsigned which = is_active(OLD) ? OLD : NEW;
            TEST_ASSERT_EQUAL_HEX32(images[which].setpoints_crc, run(&slot.program));
        }
    }
    for (int remains = 0; remains < FLASH_MODEL_REMAINS; ++remains) {
        cut_at(operations - 1u, operations - 1u, (enum flash_model_remains)remains);
    }
    free_images();
}

/* And again, at any operation of the upload that follows; in the end it succeeds. */
static void test_power_lost_again_and_again(void)
{
    load_images();
    const uint32_t operations = count_operations();
    uint64_t random = 11;
    prepare();
    for (unsigned i = 0; i < REPEATS; ++i) {
        const uint32_t at = (uint32_t)(golden_random(&random) % operations);
        const enum flash_model_remains remains =
            (enum flash_model_remains)(golden_random(&random) % FLASH_MODEL_REMAINS);
        TEST_ASSERT_FALSE(upload_until(at, remains, (uint32_t)golden_random(&random)));
        boot();
        expect_whole();
    }
    upload(NEW);
    boot();
    TEST_ASSERT_TRUE(is_active(NEW));
    TEST_ASSERT_EQUAL_HEX32(images[NEW].setpoints_crc, run(&slot.program));
    free_images();
}

/* --- parameters --- */

enum { ELDER_UM_S = 1000, OLD_UM_S = 2000, NEW_UM_S = 3000 };

static struct od_controller values;
static struct od od;
static struct parameter_store parameters;

static int save(uint32_t feed_um_s)
{
    values.configuration.feed_limit_um_s = feed_um_s;
    return parameter_store_save(&parameters, &od, feed_um_s, true);
}

/* The feed limit that is there after power-on. */
static uint32_t restored_um_s(void)
{
    chip_power_on();
    values = od_controller_defaults;
    parameter_store_find(&parameters, &od);
    TEST_ASSERT_EQUAL_INT(PARAMETER_STORE_WHOLE, parameters.state);
    TEST_ASSERT_TRUE(parameter_store_restore(&parameters, &od, 0, 0xFFFF));
    TEST_ASSERT_EQUAL_UINT32(parameters.config_crc32, values.configuration.feed_limit_um_s);
    return values.configuration.feed_limit_um_s;
}

static void prepare_parameters(void)
{
    flash_model_new();
    chip_power_on();
    values = od_controller_defaults;
    od_init(&od, &od_controller_table, &values, NULL, NULL);
    parameter_store_find(&parameters, &od);
    TEST_ASSERT_EQUAL_INT(PARAMETER_STORE_EMPTY, parameters.state);
    TEST_ASSERT_EQUAL_INT(0, save(ELDER_UM_S));
    TEST_ASSERT_EQUAL_INT(0, save(OLD_UM_S));
    TEST_ASSERT_EQUAL_UINT32(OLD_UM_S, restored_um_s());
    flash_model_save();
}

/* True: the power held out. */
static bool save_until(uint32_t operation, enum flash_model_remains remains, uint32_t seed)
{
    flash_model_cut(flash_model_operations() + operation, remains, seed, &power);
    if (setjmp(power) == 0) {
        TEST_ASSERT_EQUAL_INT(0, save(NEW_UM_S));
        flash_model_cut(UINT32_MAX, FLASH_MODEL_AFTER, 0, NULL);
        return true;
    }
    return false;
}

static void cut_save_at(uint32_t operation, uint32_t last, enum flash_model_remains remains)
{
    flash_model_restore();
    (void)restored_um_s();
    TEST_ASSERT_FALSE(save_until(operation, remains, operation));
    const uint32_t found = restored_um_s();
    if (operation < last || remains == FLASH_MODEL_BEFORE) {
        TEST_ASSERT_EQUAL_UINT32(OLD_UM_S, found);
    } else if (remains == FLASH_MODEL_AFTER) {
        TEST_ASSERT_EQUAL_UINT32(NEW_UM_S, found);
    }
    TEST_ASSERT_EQUAL_INT(0, save(NEW_UM_S));
    TEST_ASSERT_EQUAL_UINT32(NEW_UM_S, restored_um_s());
}

static void test_power_lost_at_any_operation_leaves_whole_parameters(void)
{
    prepare_parameters();
    const uint32_t before = flash_model_operations();
    TEST_ASSERT_TRUE(save_until(100000, FLASH_MODEL_AFTER, 0));
    const uint32_t operations = flash_model_operations() - before;
    TEST_ASSERT_EQUAL_UINT32(83, operations); /* a page; 80 double words, 2 of the record */
    for (uint32_t operation = 0; operation < operations; ++operation) {
        for (int remains = 0; remains < FLASH_MODEL_REMAINS; ++remains) {
            cut_save_at(operation, operations - 1u, (enum flash_model_remains)remains);
        }
    }
}

/* The programs have nothing to do with it. */
static void test_parameters_leave_the_programs_alone(void)
{
    load_images();
    prepare();
    od_init(&od, &od_controller_table, &values, NULL, NULL);
    parameter_store_find(&parameters, &od);
    TEST_ASSERT_EQUAL_INT(0, save(OLD_UM_S));
    TEST_ASSERT_EQUAL_INT(0, save(NEW_UM_S));
    upload(NEW);
    boot();
    TEST_ASSERT_TRUE(is_active(NEW));
    TEST_ASSERT_EQUAL_UINT32(NEW_UM_S, restored_um_s());
    free_images();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_page_and_a_double_word);
    RUN_TEST(test_nothing_stale_stays_in_the_cache);
    RUN_TEST(test_errors_of_the_chip_are_reported_and_do_not_stay);
    RUN_TEST(test_words_that_cannot_be_corrected);
    RUN_TEST(test_a_bank_takes_pieces_of_any_size);
    RUN_TEST(test_erasing_takes_one_page_only);
    RUN_TEST(test_a_gap_may_lead_into_the_last_page_only);
    RUN_TEST(test_what_the_store_refuses);
    RUN_TEST(test_power_lost_at_any_operation_leaves_a_whole_program);
    RUN_TEST(test_power_lost_again_and_again);
    RUN_TEST(test_power_lost_at_any_operation_leaves_whole_parameters);
    RUN_TEST(test_parameters_leave_the_programs_alone);
    return UNITY_END();
}
