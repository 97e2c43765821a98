/* SPDX-License-Identifier: MIT */
/* Tests of node/axis_motion.h: the simulated axis of a drive node. Run by `make unit`; no I/O. */
#include "node/axis_motion.h"

#include <stdlib.h>

#include "drive_bench.h"
#include "unity.h"

static struct axis_motion axis;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(0, axis_motion_init(&axis, &drive_bench_config, -2000000));
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
    while (!axis_motion_ramp(&axis, 0, 2000000000u)) {
        TEST_ASSERT_EQUAL_INT64(before - 2000, axis.speed_counts_period);
        before = axis.speed_counts_period;
        periods++;
    }
    TEST_ASSERT_EQUAL_INT(50, periods);
    TEST_ASSERT_EQUAL_INT32(target + 2450000, axis.target_counts);
    TEST_ASSERT_EQUAL_INT64(0, axis.speed_counts_period);
}

/* A ramp ends at the ends of the coordinates. */
static void test_targets_saturate(void)
{
    static const int32_t ends[2] = {INT32_MAX, INT32_MIN};
    for (int i = 0; i < 2; i++) {
        axis_motion_follow(&axis, ends[i] - (i == 0 ? 1500 : -1500));
        axis.speed_counts_period = 0;
        for (int k = 0; k < 3; k++) {
            (void)axis_motion_ramp(&axis, i == 0 ? 1000 : -1000, 2000000000u);
        }
        TEST_ASSERT_EQUAL_INT32(ends[i], axis.target_counts);
    }
}

static void test_settled_is_within_the_window(void)
{
    TEST_ASSERT_TRUE(axis_motion_settled(&axis, 0));
    axis.target_counts += 100;
    TEST_ASSERT_TRUE(axis_motion_settled(&axis, 100));
    TEST_ASSERT_FALSE(axis_motion_settled(&axis, 99));
    axis.target_counts -= 200;
    TEST_ASSERT_TRUE(axis_motion_settled(&axis, 100));
    TEST_ASSERT_FALSE(axis_motion_settled(&axis, 99));
}

static void test_stop_works_in_both_directions(void)
{
    for (int k = 1; k <= 10; k++) {
        axis_motion_follow(&axis, -2000000 - 5000 * k);
    }
    TEST_ASSERT_FALSE(axis_motion_ramp(&axis, 0, 2000000000u));
    TEST_ASSERT_EQUAL_INT64(-3000, axis.speed_counts_period);
    TEST_ASSERT_FALSE(axis_motion_ramp(&axis, 0, 2000000000u));
    TEST_ASSERT_TRUE(axis_motion_ramp(&axis, 0, 2000000000u));
    TEST_ASSERT_EQUAL_INT32(-2050000 - 3000 - 1000, axis.target_counts);
}

static void test_stop_ends_with_the_smallest_deceleration(void)
{
    axis_motion_follow(&axis, -1999990);
    int periods = 1;
    while (!axis_motion_ramp(&axis, 0, 0)) {
        TEST_ASSERT_LESS_THAN_INT(20, periods);
        periods++;
    }
    TEST_ASSERT_TRUE(axis_motion_ramp(&axis, 0, 0));
}

/* The brake is as strong as the motor: 5 V of 83 rad/s/V over 0.2 s take 3310 mm/s^2, and the damping helps. From 50
 * mm/s the braking distance is below v^2 / 2a = 0.38 mm. */
static void test_without_power_the_brake_stops_the_motor(void)
{
    for (int k = 1; k < 200; k++) {
        axis_motion_follow(&axis, -2000000 + 50000 * k);
    }
    const int32_t from = axis_motion_position(&axis);
    int periods = 1;
    while (!axis_motion_hold(&axis)) {
        TEST_ASSERT_EQUAL_INT16(0, drive_volts_mv(&axis.drive));
        TEST_ASSERT_LESS_THAN_INT(20, periods);
        periods++;
    }
    const int32_t position = axis_motion_position(&axis);
    TEST_ASSERT_GREATER_THAN_INT(10, periods);
    TEST_ASSERT_INT32_WITHIN(60000, 340000, position - from);
    TEST_ASSERT_TRUE(axis_motion_at_standstill(&axis));
    for (int k = 0; k < 300; k++) {
        TEST_ASSERT_TRUE(axis_motion_hold(&axis));
        TEST_ASSERT_EQUAL_INT32(position, axis_motion_position(&axis));
    }
    TEST_ASSERT_EQUAL_INT32(position, axis.target_counts);
}

static void test_a_load_stronger_than_the_brake_moves_it(void)
{
    axis.influence.load_volts = 4.0;
    TEST_ASSERT_TRUE(axis_motion_hold(&axis));
    axis.influence.load_volts = 6.0;
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_FALSE(axis_motion_hold(&axis));
    }
    TEST_ASSERT_LESS_THAN_INT32(-2010000, axis_motion_position(&axis));
}

static void test_scale_is_a_unit_of_the_same_place(void)
{
    TEST_ASSERT_TRUE(axis_motion_set_scale(&axis, 1000.0));
    TEST_ASSERT_EQUAL_INT32(-2000, axis_motion_position(&axis));
    for (int k = 0; k < 500; k++) {
        axis_motion_follow(&axis, -1000);
    }
    TEST_ASSERT_TRUE(drive_parked(&axis.drive));
    TEST_ASSERT_EQUAL_INT32(-1000, axis_motion_position(&axis));
    TEST_ASSERT_EQUAL_INT(0, axis_motion_set_period(&axis, 2000));
    TEST_ASSERT_EQUAL_INT32(-1000, axis_motion_position(&axis));
    TEST_ASSERT_TRUE(axis_motion_set_scale(&axis, 0.0));
    TEST_ASSERT_INT32_WITHIN(5, -1000000, axis_motion_position(&axis));
    TEST_ASSERT_FALSE(axis_motion_set_scale(&axis, 0.5));
    TEST_ASSERT_FALSE(axis_motion_set_scale(&axis, 2e9));
}

static void test_another_zero_at_the_same_place(void)
{
    const double place_mm = axis_motion_place_mm(&axis);
    axis_motion_shift(&axis, -2500000, 100);
    TEST_ASSERT_INT32_WITHIN(5, 500100, axis_motion_position(&axis));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, place_mm, axis_motion_place_mm(&axis));
    axis_motion_shift(&axis, axis_motion_position(&axis), 0);
    TEST_ASSERT_EQUAL_INT32(0, axis_motion_position(&axis));
    TEST_ASSERT_TRUE(drive_parked(&axis.drive));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, place_mm, axis_motion_place_mm(&axis));
}

static void test_a_ramp_up_and_down(void)
{
    int periods = 1;
    while (!axis_motion_ramp(&axis, -5000, 500000000u)) {
        periods++;
    }
    TEST_ASSERT_EQUAL_INT(10, periods);
    TEST_ASSERT_EQUAL_INT64(-5000, axis.speed_counts_period);
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
    RUN_TEST(test_targets_saturate);
    RUN_TEST(test_settled_is_within_the_window);
    RUN_TEST(test_stop_works_in_both_directions);
    RUN_TEST(test_stop_ends_with_the_smallest_deceleration);
    RUN_TEST(test_without_power_the_brake_stops_the_motor);
    RUN_TEST(test_a_load_stronger_than_the_brake_moves_it);
    RUN_TEST(test_scale_is_a_unit_of_the_same_place);
    RUN_TEST(test_another_zero_at_the_same_place);
    RUN_TEST(test_a_ramp_up_and_down);
    RUN_TEST(test_period_changes_at_the_same_place);
    return UNITY_END();
}
