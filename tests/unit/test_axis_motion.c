/* SPDX-License-Identifier: MIT */
#include "node/axis_motion.h"

#include <stdlib.h>

#include "unity.h"

static struct axis_motion axis;

static const struct drive_config config = {
    .plant = {83.0089, 0.19936, 1.59, 1.0 / 0.716, 5.0},
    .pdff = {97.38, 1.19, 252.8, 0.8, 0.85},
    .encoder_counts_per_rev = 1u << 20,
    .loop_rate_hz = 16000,
    .counts_per_mm = 1000000,
    .period_us = 1000,
};

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(0, axis_motion_init(&axis, &config, -2000000));
}

void tearDown(void)
{
}

static void test_begins_parked_at_its_position(void)
{
    TEST_ASSERT_TRUE(drive_parked(&axis.drive));
    TEST_ASSERT_INT32_WITHIN(5, -2000000, axis.target_counts);
}

/* From 100 mm/s with 2000 mm/s^2: 50 periods, 2.5 mm less half a period. */
static void test_stop_is_a_ramp_of_the_deceleration(void)
{
    int32_t target = -2000000;
    for (int k = 0; k < 100; k++) {
        target += 100000;
        axis_motion_follow(&axis, target);
    }
    int periods = 1;
    int64_t before = axis.speed_counts_period;
    while (!axis_motion_stop(&axis, 2000000000u)) {
        TEST_ASSERT_EQUAL_INT64(before - 2000, axis.speed_counts_period);
        before = axis.speed_counts_period;
        periods++;
    }
    TEST_ASSERT_EQUAL_INT(50, periods);
    TEST_ASSERT_EQUAL_INT32(target + 2450000, axis.target_counts);
    TEST_ASSERT_EQUAL_INT64(0, axis.speed_counts_period);
}

static void test_stop_works_both_ways(void)
{
    for (int k = 1; k <= 10; k++) {
        axis_motion_follow(&axis, -2000000 - 5000 * k);
    }
    TEST_ASSERT_FALSE(axis_motion_stop(&axis, 2000000000u));
    TEST_ASSERT_EQUAL_INT64(-3000, axis.speed_counts_period);
    TEST_ASSERT_FALSE(axis_motion_stop(&axis, 2000000000u));
    TEST_ASSERT_TRUE(axis_motion_stop(&axis, 2000000000u));
    TEST_ASSERT_EQUAL_INT32(-2050000 - 3000 - 1000, axis.target_counts);
}

static void test_stop_ends_with_the_smallest_deceleration(void)
{
    axis_motion_follow(&axis, -1999990);
    int periods = 1;
    while (!axis_motion_stop(&axis, 0)) {
        TEST_ASSERT_LESS_THAN_INT(20, periods);
        periods++;
    }
    TEST_ASSERT_TRUE(axis_motion_stop(&axis, 0));
}

static void test_hold_freezes_the_axis(void)
{
    for (int k = 1; k < 50; k++) {
        axis_motion_follow(&axis, -2000000 + 50000 * k);
    }
    axis_motion_hold(&axis);
    const int32_t position = drive_position_counts(&axis.drive);
    for (int k = 0; k < 300; k++) {
        axis_motion_hold(&axis);
        TEST_ASSERT_EQUAL_INT32(position, drive_position_counts(&axis.drive));
    }
    TEST_ASSERT_EQUAL_INT32(position, axis.target_counts);
    TEST_ASSERT_EQUAL_INT16(0, drive_volts_mv(&axis.drive));
}

static void test_period_changes_at_the_same_place(void)
{
    const int32_t position = drive_position_counts(&axis.drive);
    TEST_ASSERT_EQUAL_INT(0, axis_motion_set_period(&axis, 4000));
    TEST_ASSERT_EQUAL_UINT32(64, axis.drive.samples);
    TEST_ASSERT_INT32_WITHIN(5, position, drive_position_counts(&axis.drive));
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_RATE, axis_motion_set_period(&axis, 0));
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_RATE, axis_motion_set_period(&axis, 1001));
    TEST_ASSERT_EQUAL_UINT32(64, axis.drive.samples);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_begins_parked_at_its_position);
    RUN_TEST(test_stop_is_a_ramp_of_the_deceleration);
    RUN_TEST(test_stop_works_both_ways);
    RUN_TEST(test_stop_ends_with_the_smallest_deceleration);
    RUN_TEST(test_hold_freezes_the_axis);
    RUN_TEST(test_period_changes_at_the_same_place);
    return UNITY_END();
}
