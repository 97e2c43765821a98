/* SPDX-License-Identifier: MIT */
/* Tests of app/machine/offsets.h: what feedforward adds to the setpoints of a motion, by axis of the path. Run by
 * `make unit`; no I/O. */
#include "app/machine/offsets.h"

#include <string.h>

#include "unity.h"

#define Q40 (INT64_C(1) << 40)

static struct config config;
static struct offsets offsets;
static struct motion motion;
static struct feedforward_offset offset[AXES_MAX];

void setUp(void)
{
    memset(&config, 0, sizeof config);
    memset(&motion, 0, sizeof motion);
    config.period_us = 1000;
    config.counts_per_mm = 1000000;
    config.feedforward = CONFIG_TORQUE_FEEDFORWARD | CONFIG_VELOCITY_FEEDFORWARD;
    for (unsigned i = 0; i < PROGRAM_PLANE; ++i) {
        config.axis[i].velocity_permille = 1000;
        config.axis[i].torque_per_velocity_q16 = 65536 * 100;
        config.axis[i].torque_per_acceleration_q16 = 65536 * 10;
    }
    motion.scale.axis_count = PROGRAM_PLANE;
    offsets_init(&offsets);
}

void tearDown(void)
{
}

static void point(int64_t x_q40_mm, int64_t y_q40_mm)
{
    motion.point.position_q40[0] = x_q40_mm;
    motion.point.position_q40[1] = y_q40_mm;
    motion.setpoints++;
    offsets_step(&offsets, &config, &motion, offset);
}

/* 0.1 mm a period of 1 ms is 100 mm/s: 10^8 counts/s, 0.1 m/s, 10 per mille. */
static void test_constant_velocity(void)
{
    point(0, 0);
    TEST_ASSERT_EQUAL_INT32(0, offset[0].velocity_counts_s);
    TEST_ASSERT_EQUAL_INT16(0, offset[0].torque_permille);
    point(Q40 / 10, -Q40 / 10);
    point(2 * (Q40 / 10), -2 * (Q40 / 10));
    TEST_ASSERT_INT32_WITHIN(1, 100000000, offset[0].velocity_counts_s);
    TEST_ASSERT_INT32_WITHIN(1, -100000000, offset[1].velocity_counts_s);
    TEST_ASSERT_EQUAL_INT16(10, offset[0].torque_permille);
    TEST_ASSERT_EQUAL_INT16(-10, offset[1].torque_permille);
    config.axis[0].velocity_permille = 500;
    config.axis[1].velocity_permille = 0;
    point(3 * (Q40 / 10), -3 * (Q40 / 10));
    TEST_ASSERT_INT32_WITHIN(1, 50000000, offset[0].velocity_counts_s);
    TEST_ASSERT_EQUAL_INT32(0, offset[1].velocity_counts_s);
}

static void expect_zero(void)
{
    for (unsigned i = 0; i < PROGRAM_PLANE; ++i) {
        TEST_ASSERT_EQUAL_INT32(0, offset[i].velocity_counts_s);
        TEST_ASSERT_EQUAL_INT16(0, offset[i].torque_permille);
    }
}

static void test_zero_at_standstill_and_without_a_motion(void)
{
    point(7 * Q40, Q40);
    point(8 * Q40, Q40);
    TEST_ASSERT_TRUE(offset[0].velocity_counts_s > 0);
    offsets_step(&offsets, &config, &motion, offset); /* no new setpoint: settling */
    expect_zero();
    point(8 * Q40, Q40);
    point(8 * Q40, Q40);
    expect_zero();
    offsets_step(&offsets, &config, NULL, offset);
    expect_zero();
}

/* A new motion knows nothing of where the last one ended. */
static void test_each_motion_begins_at_rest(void)
{
    point(Q40, Q40);
    offsets_step(&offsets, &config, NULL, offset);
    motion.setpoints = 0;
    point(50 * Q40, -50 * Q40);
    expect_zero();
    point(50 * Q40, -50 * Q40);
    expect_zero();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_constant_velocity);
    RUN_TEST(test_zero_at_standstill_and_without_a_motion);
    RUN_TEST(test_each_motion_begins_at_rest);
    return UNITY_END();
}
