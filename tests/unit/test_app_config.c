/* SPDX-License-Identifier: MIT */
/* Tests of app/machine/config.h: the configuration of the host as one value. Run by `make unit`; no I/O. */
#include "app/machine/config.h"

#include <string.h>

#include "od_controller.h"
#include "unity.h"

#define Q40 (INT64_C(1) << 40)

void setUp(void)
{
}

void tearDown(void)
{
}

static struct program_limits limits_of(int32_t min_counts, int32_t max_counts,
                                       uint32_t counts_per_mm)
{
    const struct config config = {
        .period_us = 2000,
        .feed_limit_um_s = 1,
        .acceleration_limit_um_s2 = 2,
        .jerk_limit_mm_s3 = 3,
        .counts_per_mm = counts_per_mm,
        .travel = {{min_counts, max_counts}, {min_counts, max_counts}},
        .axis = {{.velocity_limit_um_s = 4},
                 {.acceleration_limit_um_s2 = 5, .jerk_limit_mm_s3 = 6}},
    };
    struct program_limits limits;
    config_limits(&config, 0, &limits);
    return limits;
}

static void test_whole_millimetres_are_exact(void)
{
    const struct program_limits limits = limits_of(-200000000, 150000000, 1000000);
    TEST_ASSERT_EQUAL_INT64(-200 * Q40, limits.min_q40_mm[0]);
    TEST_ASSERT_EQUAL_INT64(150 * Q40, limits.max_q40_mm[1]);
    const struct program_limits positive = limits_of(3000000, 4000000, 1000000);
    TEST_ASSERT_EQUAL_INT64(3 * Q40, positive.min_q40_mm[0]);
    TEST_ASSERT_EQUAL_UINT32(2000, positive.period_us);
    TEST_ASSERT_EQUAL_UINT32(3, positive.jerk_mm_s3);
    TEST_ASSERT_EQUAL_UINT32(4, positive.axis_velocity_um_s[0]);
    TEST_ASSERT_EQUAL_UINT32(5, positive.axis_acceleration_um_s2[1]);
    TEST_ASSERT_EQUAL_UINT32(6, positive.axis_jerk_mm_s3[1]);
}

/* 2^40 / 3 = 366503875925.33...: limits never let more through than was requested. */
static void test_fractions_are_rounded_inwards(void)
{
    const struct program_limits limits = limits_of(1, 2, 3);
    TEST_ASSERT_EQUAL_INT64(INT64_C(366503875926), limits.min_q40_mm[0]);
    TEST_ASSERT_EQUAL_INT64(INT64_C(733007751850), limits.max_q40_mm[0]);
    const struct program_limits negative = limits_of(-2, -1, 3);
    TEST_ASSERT_EQUAL_INT64(INT64_C(-733007751850), negative.min_q40_mm[0]);
    TEST_ASSERT_EQUAL_INT64(INT64_C(-366503875926), negative.max_q40_mm[0]);
}

static void test_the_ends_of_the_range(void)
{
    const struct program_limits coarse = limits_of(INT32_MIN, INT32_MAX, 1024);
    TEST_ASSERT_EQUAL_INT64(-2097152 * Q40, coarse.min_q40_mm[0]);
    const struct program_limits fine = limits_of(INT32_MIN, INT32_MAX, CONFIG_COUNTS_PER_MM_MAX);
    TEST_ASSERT_EQUAL_INT64(-256 * Q40, fine.min_q40_mm[0]);
    TEST_ASSERT_EQUAL_INT64(256 * Q40 - (Q40 >> 23), fine.max_q40_mm[0]);
}

static void test_values_that_make_no_sense(void)
{
    TEST_ASSERT_TRUE(config_value_allowed(0x1006, 0, 4000));
    TEST_ASSERT_FALSE(config_value_allowed(0x1006, 0, 3000));
    TEST_ASSERT_FALSE(config_value_allowed(0x2004, 7, 0));
    TEST_ASSERT_TRUE(config_value_allowed(0x2004, 7, CONFIG_COUNTS_PER_MM_MAX));
    TEST_ASSERT_FALSE(config_value_allowed(0x2004, 7, CONFIG_COUNTS_PER_MM_MAX + 1u));
    TEST_ASSERT_TRUE(config_value_allowed(0x2033, 4, 0));
    TEST_ASSERT_TRUE(config_value_allowed(0x2033, 4, CONFIG_COUNTS_PER_MM_MAX));
    TEST_ASSERT_FALSE(config_value_allowed(0x2033, 4, CONFIG_COUNTS_PER_MM_MAX + 1u));
}

static void test_which_objects_concern_the_drives(void)
{
    TEST_ASSERT_TRUE(config_concerns_drives(0x1006, 0));
    TEST_ASSERT_TRUE(config_concerns_drives(0x2004, 1));
    TEST_ASSERT_FALSE(config_concerns_drives(0x2004, 2));
    TEST_ASSERT_TRUE(config_concerns_drives(0x2007, 6));
    TEST_ASSERT_TRUE(config_contains(0x2005));
    TEST_ASSERT_FALSE(config_contains(0x2008));
    TEST_ASSERT_FALSE(config_concerns_drives(0x2004, 9));
    TEST_ASSERT_TRUE(config_concerns_drives(0x2004, 11));
    TEST_ASSERT_TRUE(config_concerns_drives(0x2012, 1));
    TEST_ASSERT_FALSE(config_concerns_drives(0x2018, 1));
    TEST_ASSERT_FALSE(config_concerns_drives(0x2032, 1));
    TEST_ASSERT_TRUE(config_concerns_drives(0x2033, 6));
    TEST_ASSERT_TRUE(config_contains(0x2033));
    TEST_ASSERT_FALSE(config_concerns_drives(0x201A, 6));
    TEST_ASSERT_TRUE(config_concerns_drives(0x201F, 1));
    TEST_ASSERT_TRUE(config_contains(0x2023));
    TEST_ASSERT_FALSE(config_contains(0x2017));
    TEST_ASSERT_FALSE(config_contains(0x201C));
    TEST_ASSERT_FALSE(config_contains(0x2024));
}

/* Each object reaches the field of its axis, with its sign. */
static void test_every_axis_object_is_read(void)
{
    struct od_controller values = od_controller_defaults;
    struct od od;
    struct config config;
    od_init(&od, &od_controller_table, &values, NULL, NULL);
    values.configuration.answer_wait_ms = 5;
    values.configuration.missed_max = 3;
    values.configuration.setpoint_timeout_ms = 60000;
    values.configuration.feedforward = 2;
    values.homing_method[0] = -3;
    values.home_offset[5] = INT32_MIN;
    values.velocity_feedforward[1] = 2000;
    values.torque_per_acceleration[2] = -65536;
    values.following_error_window[3] = 4000000000u;
    values.following_error_time_out[4] = 65535;
    values.gear_shaft_revolutions[5] = 7;
    config_read(&config, &od);
    TEST_ASSERT_EQUAL_UINT16(5, config.answer_wait_ms);
    TEST_ASSERT_EQUAL_UINT8(3, config.missed_max);
    TEST_ASSERT_EQUAL_UINT16(60000, config.setpoint_timeout_ms);
    TEST_ASSERT_EQUAL_UINT8(CONFIG_VELOCITY_FEEDFORWARD, config.feedforward);
    TEST_ASSERT_EQUAL_INT32(-3, config.axis[0].homing_method);
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, config.axis[5].home_offset_counts);
    TEST_ASSERT_EQUAL_UINT32(2000, config.axis[1].velocity_permille);
    TEST_ASSERT_EQUAL_INT32(-65536, config.axis[2].torque_per_acceleration_q16);
    TEST_ASSERT_EQUAL_UINT32(4000000000u, config.axis[3].following_window_counts);
    TEST_ASSERT_EQUAL_UINT32(65535, config.axis[4].following_timeout_ms);
    TEST_ASSERT_EQUAL_UINT32(7, config.axis[5].gear_shaft_revolutions);
    TEST_ASSERT_EQUAL_UINT32(2000000000u, config.axis[0].quick_stop_counts_s2);
}

/* An axis that turns has its own counts of a degree; what is configured for mm holds for degrees. */
static void test_a_rotary_axis(void)
{
    struct od_controller values = od_controller_defaults;
    struct od od;
    struct config config;
    struct program_limits limits;
    od_init(&od, &od_controller_table, &values, NULL, NULL);
    values.configuration.axis_count = 5;
    values.configuration.counts_per_mm = 1000000;
    values.configuration.start_tolerance_counts = 5000;
    values.configuration.feed_limit_um_s = 400000;
    values.counts_per_unit[4] = 100000;
    values.axis_velocity_limit[4] = 360000;
    values.travel_minimum[4] = -1200000;
    values.travel_maximum[4] = 36000000;
    values.travel_maximum[3] = 36000000;
    config_read(&config, &od);
    TEST_ASSERT_EQUAL_UINT32(1000000, config_counts_per_unit(&config, 3));
    TEST_ASSERT_EQUAL_UINT32(100000, config_counts_per_unit(&config, 4));
    TEST_ASSERT_EQUAL_UINT32(5000, config_tolerance_counts(&config, 3));
    TEST_ASSERT_EQUAL_UINT32(500, config_tolerance_counts(&config, 4));
    TEST_ASSERT_EQUAL_UINT32(8000000, config.deviation_counts[3]); /* 20 ms at 400 mm/s */
    TEST_ASSERT_EQUAL_UINT32(720000, config.deviation_counts[4]);  /* and at 360 deg/s */
    config_limits(&config, 0, &limits);
    TEST_ASSERT_EQUAL_INT64(36 * Q40, limits.max_q40_mm[3]);
    TEST_ASSERT_EQUAL_INT64(-12 * Q40, limits.min_q40_mm[4]);
    TEST_ASSERT_EQUAL_INT64(360 * Q40, limits.max_q40_mm[4]);
    TEST_ASSERT_EQUAL_UINT32(360000, limits.axis_velocity_um_s[4]);
    memset(&limits, 0xff, sizeof limits);
    config_limits(&config, 3, &limits); /* of a program that moves the axes from 3 on */
    TEST_ASSERT_EQUAL_INT64(36 * Q40, limits.max_q40_mm[0]);
    TEST_ASSERT_EQUAL_INT64(-12 * Q40, limits.min_q40_mm[1]);
    TEST_ASSERT_EQUAL_UINT32(360000, limits.axis_velocity_um_s[1]);
    TEST_ASSERT_EQUAL_INT64(0, limits.max_q40_mm[3]); /* there is no axis 6 */
    TEST_ASSERT_EQUAL_UINT32(0, limits.chunk);        /* so no program may begin in motion */
    struct config other = config;
    TEST_ASSERT_TRUE(config_same_zero(&config, &other, 4));
    other.axis[4].counts_per_unit = 100001;
    TEST_ASSERT_FALSE(config_same_zero(&config, &other, 4));
    TEST_ASSERT_TRUE(config_same_zero(&config, &other, 3));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_whole_millimetres_are_exact);
    RUN_TEST(test_fractions_are_rounded_inwards);
    RUN_TEST(test_the_ends_of_the_range);
    RUN_TEST(test_values_that_make_no_sense);
    RUN_TEST(test_which_objects_concern_the_drives);
    RUN_TEST(test_every_axis_object_is_read);
    RUN_TEST(test_a_rotary_axis);
    return UNITY_END();
}
