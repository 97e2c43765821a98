/* SPDX-License-Identifier: MIT */
/* What a controller has after power-on: configuration, node number and program, wherever the power went before. Run
 * by `make unit`; no I/O. */
#include "app/parameter_store.h"

#include <string.h>

#include "app/bank_record.h"
#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "core/crc32.h"

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "unity.h"

#define SAVE UINT32_C(0x65766173)
#define LOAD UINT32_C(0x64616F6C)

#define FEED_UM_S   30000u
#define OTHER_UM_S  40000u
#define VALUES_AT   12u /* of the content: after layout, CRC, flag */
#define CONTENT_MAX 2032u

enum { STATE_NONE = 0, STATE_CONFIRMED = 1, STATE_RESTORED = 2 };

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

void setUp(void)
{
    app_bench_init(&bench, 10000000, -5000000);
    bench.unconfirmed = true; /* here the host has to do it */
    app_image_make(image, 10, -5);
}

void tearDown(void)
{
}

static uint32_t read_u32(uint16_t index, uint8_t sub)
{
    return (uint32_t)(uint64_t)app_bench_read(&bench, index, sub);
}

static void write(uint16_t index, uint8_t sub, uint64_t value, uint8_t size)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, index, sub, value, size));
}

static uint32_t confirm(void)
{
    const uint32_t crc = read_u32(0x2050, 1);
    write(0x2050, 2, crc, 4);
    return crc;
}

static uint32_t save(void)
{
    return app_bench_write(&bench, 0x1010, 1, SAVE, 4);
}

static uint32_t forget(void)
{
    return app_bench_write(&bench, 0x1011, 1, LOAD, 4);
}

/* All values of these tests that differ from the defaults; returns the CRC. */
static uint32_t configure(uint32_t feed_um_s)
{
    write(0x2004, 2, feed_um_s, 4);
    write(0x2006, 2, (uint32_t)-150000000, 4);
    write(0x2007, 2, 150000000, 4);
    write(0x2012, 1, 0, 1);
    write(0x1016, 3, 0x000401F4, 4);
    return confirm();
}

static void power_cycle(void)
{
    app_bench_power_cycle(&bench);
    app_bench_settle(&bench);
}

static void expect_refusal(unsigned command, enum machine_refusal refusal)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, command));
    TEST_ASSERT_EQUAL_INT64(refusal, app_bench_read(&bench, 0x2003, 4));
}

static void expect_state(unsigned state, unsigned stored)
{
    TEST_ASSERT_EQUAL_INT64(state, app_bench_read(&bench, 0x2050, 3));
    TEST_ASSERT_EQUAL_INT64(stored, app_bench_read(&bench, 0x2050, 4));
}

/* --- configured --- */

static void test_nothing_is_switched_on_unconfigured(void)
{
    static const unsigned commands[] = {COMMAND_ENABLE, COMMAND_START, COMMAND_START_FROM,
                                        COMMAND_HOME};
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    expect_state(STATE_NONE, PARAMETER_STORE_EMPTY);
    for (unsigned i = 0; i < sizeof commands / sizeof commands[0]; ++i) {
        expect_refusal(commands[i], MACHINE_NOT_CONFIGURED);
    }
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_QUICK_STOP));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_RESET));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    const uint32_t crc = read_u32(0x2050, 1);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_write(&bench, 0x2050, 2, crc ^ 1u, 4));
    expect_refusal(COMMAND_ENABLE, MACHINE_NOT_CONFIGURED);
    TEST_ASSERT_EQUAL_HEX32(crc, confirm());
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_EMPTY);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
}

static void test_each_change_has_to_be_confirmed(void)
{
    const uint32_t first = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(first, read_u32(0x2050, 2));
    write(0x2004, 2, OTHER_UM_S, 4);
    TEST_ASSERT_NOT_EQUAL_HEX32(first, read_u32(0x2050, 1));
    TEST_ASSERT_EQUAL_HEX32(0, read_u32(0x2050, 2));
    expect_state(STATE_NONE, PARAMETER_STORE_EMPTY);
    expect_refusal(COMMAND_ENABLE, MACHINE_NOT_CONFIGURED);
    write(0x2004, 2, FEED_UM_S, 4);
    TEST_ASSERT_EQUAL_HEX32(first, read_u32(0x2050, 2));
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_EMPTY);
}

/* Every object that may be written and describes the machine; override, start position and commands do not. */
static void test_the_crc_covers_the_configuration(void)
{
    static const struct {
        uint16_t index;
        uint8_t sub;
        uint8_t size;
        uint32_t value;
        bool counts;
    } objects[] = {
        {0x1006, 0, 4, 2000, true}, {0x2004, 1, 1, 3, true},   {0x2004, 11, 1, 1, true},
        {0x2005, 2, 1, 9, true},    {0x2006, 1, 4, 5, true},   {0x2013, 2, 4, 7, true},
        {0x201A, 1, 4, 7, true},    {0x2023, 1, 4, 7, true},   {0x2051, 1, 4, 7, true},
        {0x2053, 2, 4, 7, true},    {0x2005, 4, 1, 77, false}, {0x2053, 6, 4, 7, false},
        {0x2010, 1, 2, 50, false},  {0x2011, 0, 8, 50, false}, {0x2054, 0, 1, 50, false},
        {0x1017, 0, 2, 200, false}, {0x2055, 1, 1, 1, false},
    };
    for (unsigned i = 0; i < sizeof objects / sizeof objects[0]; ++i) {
        const uint32_t before = read_u32(0x2050, 1);
        write(objects[i].index, objects[i].sub, objects[i].value, objects[i].size);
        TEST_ASSERT_EQUAL_INT_MESSAGE(objects[i].counts, before != read_u32(0x2050, 1), "CRC");
    }
}

/* --- stored --- */

static void test_a_stored_configuration_is_there_after_power_on(void)
{
    const uint32_t crc = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x1010, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_WHOLE);
    power_cycle();
    expect_state(STATE_RESTORED, PARAMETER_STORE_WHOLE);
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 1));
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 2));
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 5));
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 6));
    TEST_ASSERT_EQUAL_UINT32(FEED_UM_S, bench.controller.machine.config.feed_limit_um_s);
    TEST_ASSERT_EQUAL_HEX32(0x000401F4, read_u32(0x1016, 3));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT32(150000000, bench.drives[1].values.software_position_limit[1]);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
}

/* The hole that this closes: a program that outlives its limits. */
static void test_what_is_not_stored_is_gone(void)
{
    (void)configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    power_cycle();
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT64(PROGRAM_SLOT_READY, app_bench_read(&bench, 0x2000, 2));
    expect_state(STATE_NONE, PARAMETER_STORE_EMPTY);
    expect_refusal(COMMAND_ENABLE, MACHINE_NOT_CONFIGURED);
    expect_refusal(COMMAND_START, MACHINE_NOT_CONFIGURED);
}

static void test_an_unconfirmed_configuration_stays_one(void)
{
    write(0x2004, 2, FEED_UM_S, 4);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle();
    TEST_ASSERT_EQUAL_UINT32(FEED_UM_S, read_u32(0x2004, 2));
    expect_state(STATE_NONE, PARAMETER_STORE_WHOLE);
    (void)confirm();
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_WHOLE);
}

static void test_defaults_hold_after_load_and_power_on(void)
{
    const uint32_t defaults = read_u32(0x2050, 1);
    const uint32_t crc = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_DEFAULTS);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(crc, read_u32(0x2050, 1), "not before the reset");
    power_cycle();
    expect_state(STATE_NONE, PARAMETER_STORE_DEFAULTS);
    TEST_ASSERT_EQUAL_HEX32(defaults, read_u32(0x2050, 1));
    (void)configure(OTHER_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle();
    TEST_ASSERT_EQUAL_UINT32(OTHER_UM_S, read_u32(0x2004, 2));
}

static void test_only_with_the_signature_and_the_drives_off(void)
{
    (void)configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TRANSFER, app_bench_write(&bench, 0x1010, 1, LOAD, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TRANSFER, app_bench_write(&bench, 0x1010, 1, 1, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TRANSFER, app_bench_write(&bench, 0x1011, 1, SAVE, 4));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, save());
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, forget());
    power_cycle();
    expect_state(STATE_NONE, PARAMETER_STORE_EMPTY);
}

static void test_the_same_again_writes_nothing(void)
{
    (void)configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    (void)fake_port_cut_store(0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    TEST_ASSERT_TRUE(fake_port_cut_store(0) > 100u);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_cut_store(0));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    TEST_ASSERT_TRUE(fake_port_cut_store(0) > 0u);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_cut_store(0));
}

static void test_a_memory_that_does_not_take_it(void)
{
    const uint32_t crc = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    (void)configure(OTHER_UM_S);
    fake_port_fail_store(true);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_HARDWARE, save());
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_HARDWARE, forget());
    expect_state(STATE_CONFIRMED, PARAMETER_STORE_WHOLE);
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 5));
    power_cycle();
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 2));
}

/* --- power lost --- */

/* Old parameters stored in whichever bank; the new ones are about to be. Returns their CRCs. */
static void prepare(uint32_t crcs[2], bool second_bank)
{
    setUp();
    if (second_bank) {
        (void)configure(1000);
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    }
    crcs[0] = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    crcs[1] = configure(OTHER_UM_S);
}

static void cut_saving(bool second_bank)
{
    uint32_t crcs[2];
    prepare(crcs, second_bank);
    (void)fake_port_cut_store(0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    const uint32_t operations = fake_port_cut_store(0);
    for (uint32_t at = 1; at <= operations + 1u; ++at) {
        prepare(crcs, second_bank);
        (void)fake_port_cut_store(at);
        const bool done = at > operations;
        TEST_ASSERT_EQUAL_HEX32(done ? SDO_OK : SDO_ABORT_HARDWARE, save());
        power_cycle();
        expect_state(STATE_RESTORED, PARAMETER_STORE_WHOLE);
        TEST_ASSERT_EQUAL_HEX32(crcs[done ? 1 : 0], read_u32(0x2050, 2));
        TEST_ASSERT_EQUAL_UINT32(done ? OTHER_UM_S : FEED_UM_S, read_u32(0x2004, 2));
        (void)configure(1234); /* and the next one succeeds */
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
        power_cycle();
        TEST_ASSERT_EQUAL_UINT32(1234, read_u32(0x2004, 2));
    }
}

static void test_power_lost_at_each_byte_of_saving(void)
{
    cut_saving(false);
    cut_saving(true);
}

static void test_power_lost_at_each_byte_of_the_first_saving(void)
{
    (void)configure(FEED_UM_S);
    (void)fake_port_cut_store(0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    const uint32_t operations = fake_port_cut_store(0);
    for (uint32_t at = 1; at <= operations; ++at) {
        setUp();
        (void)configure(FEED_UM_S);
        (void)fake_port_cut_store(at);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_HARDWARE, save());
        power_cycle();
        expect_state(STATE_NONE, PARAMETER_STORE_EMPTY);
    }
}

static void test_power_lost_at_each_byte_of_forgetting(void)
{
    uint32_t crcs[2];
    prepare(crcs, false);
    (void)fake_port_cut_store(0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    const uint32_t operations = fake_port_cut_store(0);
    for (uint32_t at = 1; at <= operations; ++at) {
        prepare(crcs, false);
        (void)fake_port_cut_store(at);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_HARDWARE, forget());
        power_cycle();
        expect_state(STATE_RESTORED, PARAMETER_STORE_WHOLE);
        TEST_ASSERT_EQUAL_HEX32(crcs[0], read_u32(0x2050, 2));
    }
}

/* --- what is stored is not what this firmware would store --- */

static uint8_t content[CONTENT_MAX];

/* Puts a changed content in the place of the newest one, with a right record. */
static void store_again(uint32_t size)
{
    const unsigned bank = bench.controller.store.bank;
    const struct bank_record record = {.sequence = bench.controller.store.sequence,
                                       .size = size,
                                       .tag = crc32_update(0, content, size)};
    TEST_ASSERT_EQUAL_INT(0, port_store_erase(bank));
    TEST_ASSERT_EQUAL_INT(0, port_store_write(bank, 0, content, size));
    TEST_ASSERT_EQUAL_INT(0, bank_record_write(bank, &record));
    power_cycle();
}

/* A good elder set in one bank, the newest in the other: its content and size. */
static uint32_t store_two(void)
{
    struct bank_record record;
    (void)configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    (void)configure(OTHER_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    TEST_ASSERT_TRUE(bank_record_read(bench.controller.store.bank, &record));
    TEST_ASSERT_EQUAL_UINT32(0, record.size % 8u);
    memcpy(content, port_store_data(bench.controller.store.bank), record.size);
    return record.size;
}

static void expect_nothing_restored(enum parameter_store_state stored)
{
    expect_state(STATE_NONE, stored);
    TEST_ASSERT_EQUAL_UINT32(0, read_u32(0x2050, 5));
    TEST_ASSERT_EQUAL_UINT32(od_controller_defaults.configuration.feed_limit_um_s,
                             read_u32(0x2004, 2));
    expect_refusal(COMMAND_ENABLE, MACHINE_NOT_CONFIGURED);
    (void)configure(OTHER_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle();
    expect_state(STATE_RESTORED, PARAMETER_STORE_WHOLE);
}

static void test_a_damaged_content_is_not_replaced_by_the_elder_one(void)
{
    const uint32_t size = store_two();
    for (uint32_t at = 0; at < size; at += 61u) {
        setUp();
        (void)store_two();
        fake_port_spoil_store(bench.controller.store.bank, at);
        power_cycle();
        expect_nothing_restored(PARAMETER_STORE_DAMAGED);
    }
}

static void test_parameters_of_another_firmware(void)
{
    uint32_t size = store_two();
    store_again(size - 8u); /* fewer objects, or smaller ones */
    expect_nothing_restored(PARAMETER_STORE_OTHER);
    setUp();
    size = store_two();
    store_again(size + 8u);
    expect_nothing_restored(PARAMETER_STORE_OTHER);
    setUp();
    size = store_two();
    content[0] ^= 1u; /* other ones, that take as many bytes */
    store_again(size);
    expect_nothing_restored(PARAMETER_STORE_OTHER);
    setUp();
    (void)store_two();
    store_again(8);
    expect_nothing_restored(PARAMETER_STORE_DAMAGED);
}

/* The period is the first value: 1006. */
static void test_values_that_this_firmware_does_not_take(void)
{
    const uint32_t size = store_two();
    TEST_ASSERT_EQUAL_UINT32(1000, cob_get32(content + VALUES_AT));
    cob_put32(content + VALUES_AT, 1500);
    store_again(size);
    expect_nothing_restored(PARAMETER_STORE_DAMAGED);
    setUp();
    (void)store_two();
    const uint8_t *last = content + VALUES_AT + 4u + 24u + 2u + 1u;
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(2, *last, "axis_count follows 1006, 1016, 1017, 1029");
    content[last - content] = 7;
    store_again(size);
    expect_nothing_restored(PARAMETER_STORE_DAMAGED);
}

/* --- the program, and other machines --- */

static void test_two_machines_in_turn(void)
{
    const uint32_t wide = configure(FEED_UM_S);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_HEX32(wide, read_u32(0x2050, 6));
    const uint32_t narrow = configure(1);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(wide, read_u32(0x2050, 6), "not checked again so far");
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    expect_refusal(COMMAND_START, MACHINE_OUTSIDE_LIMITS);
    TEST_ASSERT_EQUAL_HEX32(narrow, read_u32(0x2050, 6));
    power_cycle();
    TEST_ASSERT_EQUAL_HEX32(wide, read_u32(0x2050, 2));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    expect_refusal(COMMAND_START, MACHINE_DRIVES_OFF);
    TEST_ASSERT_EQUAL_HEX32(wide, read_u32(0x2050, 6));
    TEST_ASSERT_EQUAL_HEX32(narrow, configure(1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle();
    TEST_ASSERT_EQUAL_HEX32(wide, read_u32(0x2050, 6));
    expect_refusal(COMMAND_START, MACHINE_OUTSIDE_LIMITS);
}

/* --- node number and resets --- */

static void test_a_stored_node_number_holds_from_the_next_power_on(void)
{
    write(0x2054, 0, 5, 1);
    TEST_ASSERT_EQUAL_UINT8(1, bench.controller.node);
    power_cycle();
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(1, bench.controller.node, "nobody stored it");
    write(0x2054, 0, 5, 1);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle(); /* from here on the host speaks to node 5 */
    TEST_ASSERT_EQUAL_UINT8(5, bench.controller.node);
    TEST_ASSERT_EQUAL_HEX32(0x605, read_u32(0x1200, 1));
    TEST_ASSERT_EQUAL_HEX32(0x85, read_u32(0x1014, 0));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(0x00050000u + DRIVE_CONTROLLER_TIMEOUT_MS,
                            bench.drives[0].values.consumer_heartbeat_time[0]);
    write(0x2054, 0, 0, 1);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    power_cycle();
    TEST_ASSERT_EQUAL_UINT8(1, bench.controller.node);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, app_bench_write(&bench, 0x2054, 0, 128, 1));
}

static void reset(enum nmt_command command)
{
    struct can_msg frame;
    cob_frame(&frame, COB_NMT, 2);
    frame.data[0] = (uint8_t)command;
    frame.data[1] = bench.controller.node;
    fake_port_receive(&frame);
    app_bench_settle(&bench);
}

static void test_nmt_resets_restore(void)
{
    const uint32_t crc = configure(FEED_UM_S);
    write(0x1017, 0, 300, 2);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, save());
    write(0x1017, 0, 400, 2);
    write(0x1006, 0, 2000, 4);
    write(0x2004, 2, OTHER_UM_S, 4);
    const uint32_t other = confirm();
    reset(NMT_RESET_COMMUNICATION);
    TEST_ASSERT_EQUAL_UINT32(300, read_u32(0x1017, 0));
    TEST_ASSERT_EQUAL_UINT32(1000, read_u32(0x1006, 0));
    TEST_ASSERT_EQUAL_UINT32(OTHER_UM_S, read_u32(0x2004, 2));
    TEST_ASSERT_NOT_EQUAL_HEX32(other, read_u32(0x2050, 1));
    expect_state(STATE_NONE, PARAMETER_STORE_WHOLE);
    reset(NMT_RESET_NODE);
    TEST_ASSERT_EQUAL_HEX32(crc, read_u32(0x2050, 2));
    expect_state(STATE_RESTORED, PARAMETER_STORE_WHOLE);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, forget());
    reset(NMT_RESET_NODE);
    expect_state(STATE_NONE, PARAMETER_STORE_DEFAULTS);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_switched_on_unconfigured);
    RUN_TEST(test_each_change_has_to_be_confirmed);
    RUN_TEST(test_the_crc_covers_the_configuration);
    RUN_TEST(test_a_stored_configuration_is_there_after_power_on);
    RUN_TEST(test_what_is_not_stored_is_gone);
    RUN_TEST(test_an_unconfirmed_configuration_stays_one);
    RUN_TEST(test_defaults_hold_after_load_and_power_on);
    RUN_TEST(test_only_with_the_signature_and_the_drives_off);
    RUN_TEST(test_the_same_again_writes_nothing);
    RUN_TEST(test_a_memory_that_does_not_take_it);
    RUN_TEST(test_power_lost_at_each_byte_of_saving);
    RUN_TEST(test_power_lost_at_each_byte_of_the_first_saving);
    RUN_TEST(test_power_lost_at_each_byte_of_forgetting);
    RUN_TEST(test_a_damaged_content_is_not_replaced_by_the_elder_one);
    RUN_TEST(test_parameters_of_another_firmware);
    RUN_TEST(test_values_that_this_firmware_does_not_take);
    RUN_TEST(test_two_machines_in_turn);
    RUN_TEST(test_a_stored_node_number_holds_from_the_next_power_on);
    RUN_TEST(test_nmt_resets_restore);
    return UNITY_END();
}
