/* SPDX-License-Identifier: MIT */
/* Tests of core/feedforward.h: velocity and torque offsets (0x60B1, 0x60B2) that go with the setpoints of one axis.
 * Run by `make unit`; no I/O. */
#include "core/feedforward.h"

#include "unity.h"

#define Q40               (INT64_C(1) << 40)
#define COUNTS_PER_MM_MAX 8388608u

static struct feedforward_gains gains;
static struct feedforward axis;
static struct feedforward_offset offset;

void setUp(void)
{
    gains = (struct feedforward_gains){.period_us = 1000,
                                       .counts_per_mm = 1000000,
                                       .velocity_permille = 1000,
                                       .torque_per_velocity_q16 = 65536 * 100,
                                       .torque_per_acceleration_q16 = 65536 * 10};
    feedforward_begin(&axis, 0);
}

void tearDown(void)
{
}

static void point(int64_t point_q40_mm)
{
    offset = feedforward_next(&axis, &gains, point_q40_mm);
}

/* 1 um more each period of 1 ms is 1 m/s^2: 10 per mille. */
static void test_acceleration(void)
{
    gains.torque_per_velocity_q16 = 0;
    const int64_t um = Q40 / 1000;
    feedforward_begin(&axis, 5 * Q40);
    point(5 * Q40);
    point(5 * Q40 + um);
    point(5 * Q40 + 3 * um);
    TEST_ASSERT_EQUAL_INT16(10, offset.torque_permille);
    point(5 * Q40 + 5 * um);
    TEST_ASSERT_EQUAL_INT16(0, offset.torque_permille);
    point(5 * Q40 + 6 * um);
    TEST_ASSERT_EQUAL_INT16(-10, offset.torque_permille);
}

/* The same motion sampled at each period gives the same offsets. */
static void test_every_period(void)
{
    for (uint32_t period_ms = 1; period_ms <= 8u; period_ms *= 2u) {
        gains.period_us = 1000u * period_ms;
        const int64_t distance = Q40 / 20 * (int64_t)period_ms;              /* 50 mm/s */
        const int64_t change = Q40 / 500 * (int64_t)(period_ms * period_ms); /* 2 m/s^2 */
        const struct feedforward_offset result = feedforward_offset(&gains, distance, change);
        TEST_ASSERT_INT32_WITHIN(1, 50000000, result.velocity_counts_s);
        TEST_ASSERT_EQUAL_INT16(25, result.torque_permille);
    }
}

/* Between two tenths of a count nothing is lost: points are finer than counts. */
static void test_slow_motion_is_not_rounded_to_counts(void)
{
    point(0);
    point(Q40 / 10000000);
    TEST_ASSERT_INT32_WITHIN(1, 100, offset.velocity_counts_s);
}

static void test_extremes_saturate(void)
{
    gains.counts_per_mm = COUNTS_PER_MM_MAX;
    gains.velocity_permille = 2000;
    gains.torque_per_velocity_q16 = INT32_MAX;
    gains.torque_per_acceleration_q16 = INT32_MAX;
    struct feedforward_offset result = feedforward_offset(&gains, INT64_MAX / 2, INT64_MAX / 2);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, result.velocity_counts_s);
    TEST_ASSERT_EQUAL_INT16(INT16_MAX, result.torque_permille);
    result = feedforward_offset(&gains, INT64_MIN / 2, INT64_MIN / 2);
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, result.velocity_counts_s);
    TEST_ASSERT_EQUAL_INT16(-INT16_MAX, result.torque_permille);
    gains.torque_per_velocity_q16 = INT32_MIN;
    gains.torque_per_acceleration_q16 = INT32_MIN;
    result = feedforward_offset(&gains, INT64_MAX / 2, INT64_MAX / 2);
    TEST_ASSERT_EQUAL_INT16(-INT16_MAX, result.torque_permille);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_acceleration);
    RUN_TEST(test_every_period);
    RUN_TEST(test_slow_motion_is_not_rounded_to_counts);
    RUN_TEST(test_extremes_saturate);
    return UNITY_END();
}
