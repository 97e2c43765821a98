/* SPDX-License-Identifier: MIT */
/* Tests of the homing mode of a simulated drive (sim/node/drive_homing.h). Run by `make unit`; no I/O. */
#include <math.h>

#include "canopen/cia402.h"
#include "canopen/sdo_abort.h"
#include "drive_bench.h"
#include "unity.h"

/* The axis stands at 1 mm of the machine; switches at -4, 6 and 3 ... 5 mm. */
enum {
    START = 0x001F,
    HOMING_BITS = 0x3400,
    DONE = 0x1400,
    ERROR_AT_REST = 0x2400,
    NOT_STARTED = 0x0400,
    PERIODS_MAX = 3000
};

static void equip(void)
{
    struct equipment equipment;
    equipment_init(&equipment, &drive_bench_config);
    equipment.limit_negative_mm = -4.0;
    equipment.limit_positive_mm = 6.0;
    equipment.home_from_mm = 3.0;
    equipment.home_to_mm = 5.0;
    TEST_ASSERT_TRUE(drive_node_equip(&bench.node, &equipment));
}

void setUp(void)
{
    drive_bench_begin();
    equip();
}

void tearDown(void)
{
}

static void prepare(int8_t method, int32_t offset)
{
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, CIA402_MODE_HOMING));
    TEST_ASSERT_EQUAL_INT64(CIA402_MODE_HOMING, drive_bench_read(0x6061, 0));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6098, 0, method));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x607C, 0, offset));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6099, 1, 50000000));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6099, 2, 1000000));
    drive_bench_enable();
    TEST_ASSERT_EQUAL_HEX16(bench.node.servo.homing.homed ? DONE : NOT_STARTED,
                            drive_bench_statusword() & HOMING_BITS);
}

/* Runs until bit 12 or 13 comes; the bits. */
static int home(void)
{
    bench.word = START;
    for (int k = 0; k < PERIODS_MAX; k++) {
        drive_bench_run(1);
        const int bits = drive_bench_statusword() & HOMING_BITS;
        if (k > 1 && (bits & 0x3000) != 0 && (bits & 0x0400) != 0) {
            return bits;
        }
    }
    return drive_bench_statusword() & HOMING_BITS;
}

/* Home is at `place_mm` of the machine: there the axis reads the offset. Within what the slow speed
 * covers in two periods. */
static void homes(int8_t method, int32_t offset, double place_mm)
{
    prepare(method, offset);
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
    const double read_mm = 1e-6 * axis_motion_position(&bench.node.servo.axis);
    const double home_mm =
        axis_motion_place_mm(&bench.node.servo.axis) - (read_mm - 1e-6 * (double)offset);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, place_mm, home_mm);
}

static void test_here(void)
{
    homes(37, 0, 1.0);
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_INT32(0, drive_bench_position());
    homes(35, 0, 1.0);
}

static void test_here_with_an_offset(void)
{
    homes(37, -2500000, 1.0);
    drive_bench_run(1);
    TEST_ASSERT_INT32_WITHIN(5, -2500000, drive_bench_position());
}

static void test_negative_limit_switch(void)
{
    homes(17, 0, -4.0);
}

static void test_positive_limit_switch(void)
{
    homes(18, 123456, 6.0);
}

static void test_home_switch_from_below(void)
{
    homes(19, 0, 3.0);
    homes(20, 1000, 3.0);
}

static void test_home_switch_from_above(void)
{
    prepare(18, 0); /* goes to the upper side first */
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
    bench.word = CIA402_DISABLE_VOLTAGE;
    drive_bench_run(50);
    homes(21, 0, 5.0);
    homes(22, 0, 5.0);
}

static void test_already_on_the_switch(void)
{
    homes(17, 0, -4.0);
    homes(17, 77, -4.0);
}

/* Method 19 from above the switch runs onto the positive limit switch. */
static void test_the_wrong_end_is_an_error(void)
{
    prepare(18, 0);
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
    bench.word = CIA402_DISABLE_VOLTAGE;
    drive_bench_run(50);
    prepare(19, 0);
    TEST_ASSERT_EQUAL_HEX16(ERROR_AT_REST, home());
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.node.servo.device.state);
    bench.word = CIA402_ENABLE_OPERATION; /* another method helps */
    drive_bench_run(2);
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6098, 0, 21));
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
}

static void test_interrupted_and_begun_again(void)
{
    prepare(17, 0);
    bench.word = START;
    drive_bench_run(20);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & HOMING_BITS);
    bench.word = CIA402_ENABLE_OPERATION;
    drive_bench_run(200);
    TEST_ASSERT_EQUAL_HEX16(NOT_STARTED, drive_bench_statusword() & HOMING_BITS);
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
}

static void test_halt_holds_homing_up(void)
{
    prepare(17, 0);
    bench.word = START;
    drive_bench_run(50);
    bench.word = START | CIA402_CONTROL_HALT;
    drive_bench_run(200);
    const int32_t position = drive_bench_position();
    drive_bench_run(200);
    TEST_ASSERT_INT32_WITHIN(50, position, drive_bench_position());
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
}

static void test_disabled_while_enabling(void)
{
    prepare(17, 0);
    bench.word = START;
    drive_bench_run(50);
    bench.word = CIA402_DISABLE_VOLTAGE;
    drive_bench_run(100);
    TEST_ASSERT_EQUAL_HEX16(NOT_STARTED, drive_bench_statusword() & HOMING_BITS);
    TEST_ASSERT_TRUE(axis_motion_at_standstill(&bench.node.servo.axis));
}

static void test_modes_change_at_rest_only(void)
{
    prepare(17, 0);
    bench.word = START;
    drive_bench_run(50);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, drive_bench_write(0x6060, 0, CIA402_MODE_CSP));
    TEST_ASSERT_EQUAL_HEX16(DONE, home());
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, CIA402_MODE_CSP));
    TEST_ASSERT_EQUAL_INT64(CIA402_MODE_CSP, drive_bench_read(0x6061, 0));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, drive_bench_write(0x6060, 0, 1));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, 0)); /* no change */
    TEST_ASSERT_EQUAL_INT64(CIA402_MODE_CSP, drive_bench_read(0x6061, 0));
}

/* A drive that follows moving setpoints keeps its mode. */
static void test_no_homing_while_setpoints_move(void)
{
    drive_bench_enable();
    bench.target += 1000;
    drive_bench_run(2);
    for (int k = 0; k < 5; k++) {
        bench.target += 1000;
        drive_bench_run(1);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, drive_bench_write(0x6060, 0, CIA402_MODE_HOMING));
    }
    drive_bench_run(3);
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, CIA402_MODE_HOMING));
    TEST_ASSERT_EQUAL_INT64(CIA402_MODE_HOMING, drive_bench_read(0x6061, 0));
}

/* By SDO alone and without any SYNC: the drive goes by its own clock. */
static void test_without_sync(void)
{
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, CIA402_MODE_HOMING));
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6098, 0, 17));
    const uint16_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION, START};
    for (int i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6040, 0, words[i]));
    }
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_read(0x6041, 0) & HOMING_BITS);
    for (int k = 0; k < 500 && (drive_bench_read(0x6041, 0) & HOMING_BITS) == 0; k++) {
        drive_node_process(&bench.node, 10000);
    }
    TEST_ASSERT_EQUAL_HEX16(DONE, drive_bench_read(0x6041, 0) & HOMING_BITS);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.node.servo.device.state);
    TEST_ASSERT_EQUAL_INT64(0, drive_bench_read(0x603F, 0));
}

static void test_methods_that_exist(void)
{
    for (int method = -128; method <= 127; method++) {
        const bool exists = (method >= 17 && method <= 22) || method == 35 || method == 37;
        TEST_ASSERT_EQUAL_HEX32(exists ? SDO_OK : SDO_ABORT_VALUE,
                                drive_bench_write(0x6098, 0, method));
    }
    TEST_ASSERT_EQUAL_INT64(8, drive_bench_read(0x60E3, 0));
    for (uint8_t sub = 1; sub <= 8; sub++) {
        TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                                drive_bench_write(0x6098, 0, drive_bench_read(0x60E3, sub)));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_here);
    RUN_TEST(test_here_with_an_offset);
    RUN_TEST(test_negative_limit_switch);
    RUN_TEST(test_positive_limit_switch);
    RUN_TEST(test_home_switch_from_below);
    RUN_TEST(test_home_switch_from_above);
    RUN_TEST(test_already_on_the_switch);
    RUN_TEST(test_the_wrong_end_is_an_error);
    RUN_TEST(test_interrupted_and_begun_again);
    RUN_TEST(test_halt_holds_homing_up);
    RUN_TEST(test_disabled_while_enabling);
    RUN_TEST(test_modes_change_at_rest_only);
    RUN_TEST(test_no_homing_while_setpoints_move);
    RUN_TEST(test_without_sync);
    RUN_TEST(test_methods_that_exist);
    return UNITY_END();
}
