/* SPDX-License-Identifier: MIT */
/* The offsets of feedforward on the bus: in the right frames, in motion only. Run by `make unit`; no I/O. */
#include "app/commands.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "app_image.h"
#include "unity.h"

#define FEED_COUNTS_S 15000000

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

void setUp(void)
{
    app_bench_init(&bench, 10000000, -5000000);
    app_image_make(image, 10, -5);
}

void tearDown(void)
{
}

static const struct fake_drive *x_drive(void)
{
    return &bench.drives[0];
}

/* Ready to start, with so much feedforward. */
static void prepare(unsigned feedforward)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, feedforward, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2018, 1, 800, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2019, 1, 65536 * 1000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201A, 1, 65536 * 2000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
}

static void start(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
}

static void expect_nothing(void)
{
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        TEST_ASSERT_EQUAL_INT32(0, bench.drives[i].velocity_counts_s);
        TEST_ASSERT_EQUAL_INT16(0, bench.drives[i].torque_permille);
    }
}

static void test_off(void)
{
    prepare(0);
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_EQUAL_UINT8(6, x_drive()->setpoint_size);
    TEST_ASSERT_EQUAL_UINT32(0, x_drive()->velocities);
}

/* 15 mm/s: 0.8 of it as velocity; 2000 per mille for 1 m/s is 30. */
static void test_both(void)
{
    prepare(3);
    expect_nothing();
    TEST_ASSERT_EQUAL_UINT8(8, x_drive()->setpoint_size);
    start();
    const uint32_t before = x_drive()->velocities;
    bool accelerated = false;
    for (uint32_t k = 0; k < 250u; ++k) {
        app_bench_period(&bench);
        accelerated = accelerated || x_drive()->torque_permille > 30;
    }
    TEST_ASSERT_TRUE(accelerated);
    TEST_ASSERT_EQUAL_UINT32(250, x_drive()->velocities - before);
    TEST_ASSERT_INT32_WITHIN(1000, FEED_COUNTS_S * 8 / 10, x_drive()->velocity_counts_s);
    TEST_ASSERT_INT_WITHIN(4, 30, x_drive()->torque_permille);
    TEST_ASSERT_EQUAL_INT32(0, bench.drives[1].velocity_counts_s);
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    expect_nothing();
}

/* velocity(k) belongs to the distance from setpoint k-1 to setpoint k. */
static void test_velocity_belongs_to_the_distance_of_its_setpoint(void)
{
    prepare(2);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    int32_t last_counts = x_drive()->target_counts;
    for (uint32_t k = 0; k < APP_IMAGE_TICKS; ++k) {
        app_bench_period(&bench);
        const int32_t way_counts = x_drive()->target_counts - last_counts;
        last_counts = x_drive()->target_counts;
        TEST_ASSERT_INT32_WITHIN(801, way_counts * 800, x_drive()->velocity_counts_s);
    }
    TEST_ASSERT_EQUAL_UINT8(6, x_drive()->setpoint_size);
}

static void test_nothing_while_held_and_off(void)
{
    prepare(3);
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOLD));
    (void)app_bench_until(&bench, MACHINE_HELD, 2000);
    app_bench_periods(&bench, 3);
    expect_nothing();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_RESUME));
    app_bench_periods(&bench, 100);
    TEST_ASSERT_TRUE(x_drive()->velocity_counts_s > 0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_QUICK_STOP));
    app_bench_periods(&bench, 1);
    expect_nothing();
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
    expect_nothing();
}

/* The gains may change while the drives stay configured; the PDOs may not. */
static void test_gains_change_without_a_new_boot(void)
{
    prepare(3);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2018, 1, 100, 2));
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 1, 1));
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
}

static void expect_pdo(uint16_t index, uint8_t sub, uint32_t value)
{
    TEST_ASSERT_EQUAL_HEX32(value, (uint32_t)app_bench_read(&bench, index, sub));
}

static void test_the_dictionary_describes_what_is_sent_without_offsets(void)
{
    prepare(0);
    expect_pdo(0x1400, 1, 0x182);
    expect_pdo(0x1800, 1, 0x202);
    expect_pdo(0x1801, 1, 0x203);
    expect_pdo(0x1402, 1, 0x80000184); /* no third axis */
    expect_pdo(0x1802, 1, 0x80000204);
    expect_pdo(0x1A00, 0, 2);
    expect_pdo(0x1A00, 3, 0);
    expect_pdo(0x1806, 1, 0x80000302);
    expect_pdo(0x1A06, 0, 0);
    expect_pdo(0x1A06, 1, 0);
}

static void test_the_dictionary_describes_what_is_sent_with_offsets(void)
{
    prepare(3);
    expect_pdo(0x1A00, 0, 3);
    expect_pdo(0x1A00, 2, 0x200D0120);
    expect_pdo(0x1A01, 3, 0x202B0210);
    expect_pdo(0x1806, 1, 0x302);
    expect_pdo(0x1808, 1, 0x80000304);
    expect_pdo(0x1A07, 0, 1);
    expect_pdo(0x1A07, 1, 0x202C0220);
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_TRUE(x_drive()->torque_permille > 0);
    expect_pdo(0x202B, 1, (uint32_t)x_drive()->torque_permille);
    expect_pdo(0x202C, 1, (uint32_t)x_drive()->velocity_counts_s);
    expect_pdo(0x202C, 2, 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_off);
    RUN_TEST(test_both);
    RUN_TEST(test_velocity_belongs_to_the_distance_of_its_setpoint);
    RUN_TEST(test_nothing_while_held_and_off);
    RUN_TEST(test_the_dictionary_describes_what_is_sent_without_offsets);
    RUN_TEST(test_the_dictionary_describes_what_is_sent_with_offsets);
    RUN_TEST(test_gains_change_without_a_new_boot);
    return UNITY_END();
}
