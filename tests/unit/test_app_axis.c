/* SPDX-License-Identifier: MIT */
#include "app/axis.h"

#include "unity.h"

#define TOLERANCE 100u

static struct axis axis;
static struct can_msg frame;

void setUp(void)
{
    axis_init(&axis, 5);
}

void tearDown(void)
{
}

static void answer(enum cia402_state state, int32_t position_counts, uint32_t now_us)
{
    const struct pdo_actual actual = {.statusword = cia402_status_bits(state),
                                      .position_counts = position_counts};
    axis_receive(&axis, &actual, now_us);
}

static struct pdo_setpoint sent(void)
{
    struct pdo_setpoint setpoint;
    axis_setpoint(&axis, TOLERANCE, &frame);
    TEST_ASSERT_EQUAL_INT(5, pdo_decode_setpoint(&frame, &setpoint));
    return setpoint;
}

static void test_target_follows_until_the_drive_is_told_to_follow(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_SWITCH_ON_DISABLED, 1000, 0);
    TEST_ASSERT_EQUAL_INT32(1000, sent().target_counts);
    answer(CIA402_SWITCHED_ON, 1010, 0);
    const struct pdo_setpoint last = sent();
    TEST_ASSERT_EQUAL_HEX16(CIA402_ENABLE_OPERATION, last.controlword);
    TEST_ASSERT_EQUAL_INT32(1010, last.target_counts);
    answer(CIA402_SWITCHED_ON, 1020, 0);
    TEST_ASSERT_EQUAL_INT32(1010, sent().target_counts);
    answer(CIA402_OPERATION_ENABLED, 1030, 0);
    TEST_ASSERT_EQUAL_INT32(1010, sent().target_counts);
}

static void test_switching_off_lets_the_target_follow_again(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_SWITCHED_ON, 7, 0);
    (void)sent();
    answer(CIA402_OPERATION_ENABLED, 7, 0);
    (void)sent();
    axis.goal = CIA402_GOAL_OFF;
    (void)sent();
    answer(CIA402_SWITCH_ON_DISABLED, 99, 0);
    TEST_ASSERT_EQUAL_INT32(99, sent().target_counts);
}

static void hold(int32_t position_counts, uint32_t syncs)
{
    for (uint32_t k = 0; k < syncs; ++k) {
        answer(CIA402_OPERATION_ENABLED, position_counts, 0);
        (void)sent();
    }
}

static void test_standstill_needs_250_syncs_at_the_target(void)
{
    hold(0, AXIS_STANDSTILL_SYNCS - 1u);
    TEST_ASSERT_FALSE(axis_still(&axis));
    hold((int32_t)TOLERANCE, 1);
    TEST_ASSERT_TRUE(axis_still(&axis));
    hold((int32_t)TOLERANCE + 1, 1);
    TEST_ASSERT_FALSE(axis_still(&axis));
    hold(0, AXIS_STANDSTILL_SYNCS);
    axis.target_counts = 1;
    hold(0, 1);
    TEST_ASSERT_FALSE(axis_still(&axis));
}

static void test_a_drive_that_is_off_does_not_stand_still(void)
{
    for (uint32_t k = 0; k < 2u * AXIS_STANDSTILL_SYNCS; ++k) {
        answer(CIA402_SWITCH_ON_DISABLED, 0, 0);
        (void)sent();
    }
    TEST_ASSERT_FALSE(axis_still(&axis));
}

static void test_missed_answers_are_counted_once_the_drive_has_answered(void)
{
    TEST_ASSERT_FALSE(axis_close_sync(&axis));
    answer(CIA402_SWITCHED_ON, 0, 0);
    TEST_ASSERT_FALSE(axis_close_sync(&axis));
    TEST_ASSERT_TRUE(axis_close_sync(&axis));
    TEST_ASSERT_EQUAL_UINT32(1, axis.missed_in_row);
    answer(CIA402_SWITCHED_ON, 0, 0);
    TEST_ASSERT_EQUAL_UINT32(0, axis.missed_in_row);
}

/* The clock wraps in between. */
static void test_lost_by_syncs_or_by_time(void)
{
    const uint32_t last_us = UINT32_MAX - 10u;
    answer(CIA402_SWITCHED_ON, 0, last_us);
    axis.missed_in_row = AXIS_MISSED_LOST;
    TEST_ASSERT_FALSE(axis_lost(&axis, last_us + 500000u));
    axis.missed_in_row = AXIS_MISSED_LOST + 1u;
    TEST_ASSERT_TRUE(axis_lost(&axis, last_us + 500000u));
    axis.missed_in_row = AXIS_MISSED_MAX + 1u;
    TEST_ASSERT_FALSE(axis_lost(&axis, last_us + AXIS_SILENCE_MAX_US));
    TEST_ASSERT_TRUE(axis_lost(&axis, last_us + AXIS_SILENCE_MAX_US + 1u));
    axis.missed_in_row = AXIS_MISSED_MAX;
    TEST_ASSERT_FALSE(axis_lost(&axis, last_us + 5u * AXIS_SILENCE_MAX_US));
}

static void test_distance_is_that_of_the_farther_one_without_overflow(void)
{
    axis.target_counts = INT32_MAX;
    axis.position_counts = 0;
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, axis_distance(&axis, INT32_MIN));
    axis.target_counts = -3;
    axis.position_counts = 9;
    TEST_ASSERT_EQUAL_UINT32(8, axis_distance(&axis, 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_target_follows_until_the_drive_is_told_to_follow);
    RUN_TEST(test_switching_off_lets_the_target_follow_again);
    RUN_TEST(test_standstill_needs_250_syncs_at_the_target);
    RUN_TEST(test_a_drive_that_is_off_does_not_stand_still);
    RUN_TEST(test_missed_answers_are_counted_once_the_drive_has_answered);
    RUN_TEST(test_lost_by_syncs_or_by_time);
    RUN_TEST(test_distance_is_that_of_the_farther_one_without_overflow);
    return UNITY_END();
}
