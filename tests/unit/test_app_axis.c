/* SPDX-License-Identifier: MIT */
/* Tests of app/machine/axis.h: one drive as the tick uses it. Run by `make unit`; no I/O. */
#include "app/machine/axis.h"

#include "unity.h"

#define TOLERANCE 100u

static const struct config_travel travel = {-20000, 20000};

static struct axis axis;

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
    axis_setpoint(&axis, TOLERANCE, &travel);
    axis_sent(&axis);
    TEST_ASSERT_EQUAL_INT(5, pdo_decode_setpoint(&axis.setpoint, &setpoint));
    return setpoint;
}

static void test_target_follows_until_the_drive_is_seen_enabled(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_SWITCH_ON_DISABLED, 1000, 0);
    TEST_ASSERT_EQUAL_INT32(1000, sent().target_counts);
    answer(CIA402_SWITCHED_ON, 1010, 0);
    const struct pdo_setpoint last = sent();
    TEST_ASSERT_EQUAL_HEX16(CIA402_ENABLE_OPERATION, last.controlword);
    TEST_ASSERT_EQUAL_INT32(1010, last.target_counts);
    answer(CIA402_SWITCHED_ON, 1020, 0);
    TEST_ASSERT_EQUAL_INT32(1020, sent().target_counts);
    answer(CIA402_OPERATION_ENABLED, 1030, 0);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(1020, sent().target_counts, "what it follows already");
    answer(CIA402_OPERATION_ENABLED, 1040, 0);
    TEST_ASSERT_EQUAL_INT32(1020, sent().target_counts);
}

static void test_the_target_of_a_drive_that_comes_on_is_inside_the_travel(void)
{
    answer(CIA402_SWITCH_ON_DISABLED, 20003, 0);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(20003, sent().target_counts, "off");
    axis.goal = CIA402_GOAL_ENABLED;
    TEST_ASSERT_EQUAL_INT32(20000, sent().target_counts);
    answer(CIA402_SWITCHED_ON, -20001, 0);
    TEST_ASSERT_EQUAL_INT32(-20000, sent().target_counts);
    axis.moves_by_drive = true;
    TEST_ASSERT_EQUAL_INT32_MESSAGE(-20001, sent().target_counts, "homing");
}

/* A frame that did not leave moved nothing: the quick stop's target is the one before. */
static void test_a_quick_stop_takes_the_target_that_was_sent(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_OPERATION_ENABLED, 50, 0);
    axis.target_counts = 60;
    (void)sent();
    axis.target_counts = 70;
    axis_setpoint(&axis, TOLERANCE, &travel);
    axis_command(&axis, CIA402_GOAL_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT32(60, sent().target_counts);
}

/* One wrong statusword, with a wrong position in the same frame, moves nothing. */
static void test_a_statusword_that_lies_once_does_not_move_the_target(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_OPERATION_ENABLED, 50, 0);
    (void)sent();
    axis.target_counts = 60;
    (void)sent();
    answer(CIA402_SWITCHED_ON, 9999, 0);
    TEST_ASSERT_TRUE(axis_left_operation_enabled(&axis));
    TEST_ASSERT_EQUAL_INT32(60, sent().target_counts);
    axis_command(&axis, CIA402_GOAL_QUICK_STOP);
    const struct pdo_setpoint stop = sent();
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP, stop.controlword);
    TEST_ASSERT_EQUAL_INT32(60, stop.target_counts);
}

static void test_a_quick_stop_leaves_the_target_until_the_drive_is_off(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_OPERATION_ENABLED, 50, 0);
    (void)sent();
    axis.target_counts = 60;
    (void)sent();
    axis_command(&axis, CIA402_GOAL_QUICK_STOP);
    answer(CIA402_QUICK_STOP_ACTIVE, 70, 0);
    TEST_ASSERT_EQUAL_INT32(60, sent().target_counts);
    TEST_ASSERT_FALSE(axis_has_stopped(&axis));
    answer(CIA402_SWITCH_ON_DISABLED, 80, 0);
    TEST_ASSERT_EQUAL_INT32(60, sent().target_counts);
    TEST_ASSERT_TRUE(axis_has_stopped(&axis));
    axis_command(&axis, CIA402_GOAL_OFF);
    TEST_ASSERT_EQUAL_INT32(80, sent().target_counts);
}

static void test_a_garbled_statusword_has_to_come_twice_to_mean_stopped(void)
{
    const struct pdo_actual garbled = {.statusword = 0x0002, .position_counts = 70};
    answer(CIA402_QUICK_STOP_ACTIVE, 70, 0);
    axis_receive(&axis, &garbled, 0);
    TEST_ASSERT_FALSE(axis_has_stopped(&axis));
    axis_receive(&axis, &garbled, 0);
    TEST_ASSERT_TRUE(axis_has_stopped(&axis));
    answer(CIA402_QUICK_STOP_ACTIVE, 70, 0);
    TEST_ASSERT_FALSE(axis_has_stopped(&axis));
    answer(CIA402_FAULT, 70, 0);
    TEST_ASSERT_TRUE(axis_has_stopped(&axis));
}

static void test_homing_adds_its_bits_and_follows_the_position(void)
{
    axis.moves_by_drive = true;
    axis.control_extra = 0x10;
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_SWITCH_ON_DISABLED, 1, 0);
    TEST_ASSERT_EQUAL_HEX16(CIA402_SHUTDOWN, sent().controlword);
    answer(CIA402_OPERATION_ENABLED, 2, 0);
    TEST_ASSERT_EQUAL_HEX16(CIA402_ENABLE_OPERATION | 0x10, sent().controlword);
    answer(CIA402_OPERATION_ENABLED, 300, 0);
    TEST_ASSERT_EQUAL_INT32(300, sent().target_counts);
    TEST_ASSERT_TRUE_MESSAGE(axis_reached(&axis), "bit 12 means something else while homing");
    axis_command(&axis, CIA402_GOAL_QUICK_STOP);
    answer(CIA402_QUICK_STOP_ACTIVE, 400, 0);
    const struct pdo_setpoint stop = sent();
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP, stop.controlword);
    TEST_ASSERT_EQUAL_INT32(300, stop.target_counts);
}

static void test_enabled_means_that_the_target_is_followed(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    answer(CIA402_OPERATION_ENABLED, 0, 0);
    TEST_ASSERT_FALSE(axis_reached(&axis));
    const struct pdo_actual actual = {.statusword = cia402_status_bits(CIA402_OPERATION_ENABLED) |
                                                    CIA402_STATUS_FOLLOWS};
    axis_receive(&axis, &actual, 0);
    TEST_ASSERT_TRUE(axis_reached(&axis));
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
    axis.goal = CIA402_GOAL_ENABLED;
    for (uint32_t k = 0; k < syncs; ++k) {
        answer(CIA402_OPERATION_ENABLED, position_counts, 0);
        (void)sent();
    }
}

static void test_standstill_needs_250_syncs_at_the_target(void)
{
    hold(0, AXIS_STANDSTILL_SYNCS - 1u);
    TEST_ASSERT_FALSE(axis_stands(&axis));
    hold((int32_t)TOLERANCE, 1);
    TEST_ASSERT_TRUE(axis_stands(&axis));
    hold((int32_t)TOLERANCE + 1, 1);
    TEST_ASSERT_FALSE(axis_stands(&axis));
    hold(0, AXIS_STANDSTILL_SYNCS);
    axis.target_counts = 1;
    hold(0, 1);
    TEST_ASSERT_FALSE(axis_stands(&axis));
}

static void test_a_drive_that_is_off_does_not_stand_still(void)
{
    for (uint32_t k = 0; k < 2u * AXIS_STANDSTILL_SYNCS; ++k) {
        answer(CIA402_SWITCH_ON_DISABLED, 0, 0);
        (void)sent();
    }
    TEST_ASSERT_FALSE(axis_stands(&axis));
}

/* The frame is kept and only what changes is written: it must be the one that would be made anew. */
static void test_the_kept_frame_is_the_whole_setpoint(void)
{
    static const int32_t targets[] = {0, 70000, -1, -1, INT32_MIN, 255, 256};
    axis.goal = CIA402_GOAL_ENABLED;
    for (uint32_t k = 0; k < sizeof targets / sizeof targets[0]; ++k) {
        struct can_msg whole;
        answer(k == 3 ? CIA402_SWITCHED_ON : CIA402_OPERATION_ENABLED, 5, 0);
        axis.target_counts = targets[k];
        axis.goal = k == 5 ? CIA402_GOAL_QUICK_STOP : CIA402_GOAL_ENABLED;
        (void)sent();
        const struct pdo_setpoint setpoint = {.controlword = axis.controlword,
                                              .target_counts = axis.target_counts};
        pdo_encode_setpoint(5, &setpoint, &whole);
        TEST_ASSERT_EQUAL_HEX32(whole.id, axis.setpoint.id);
        TEST_ASSERT_EQUAL_UINT8(whole.len, axis.setpoint.len);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(whole.data, axis.setpoint.data, CAN_DATA_MAX);
    }
}

/* Well is noted with each answer; a restart and a loss end it at once. */
static void test_well_ends_with_a_restart_with_a_loss_and_with_trouble_that_stays(void)
{
    axis.goal = CIA402_GOAL_ENABLED;
    const struct pdo_actual good = {.statusword = 0x1237};
    const struct pdo_actual unfed = {.statusword = 0x1227};
    axis_receive(&axis, &good, 0);
    TEST_ASSERT_TRUE(axis_healthy(&axis));
    axis.tpdo1.lost = true;
    TEST_ASSERT_FALSE(axis_healthy(&axis));
    for (uint32_t k = 0; k < STATUSWORD_MONITOR_TOLERATED; ++k) {
        axis_receive(&axis, &unfed, 0);
        TEST_ASSERT_TRUE(axis_healthy(&axis));
    }
    axis_receive(&axis, &unfed, 0);
    TEST_ASSERT_FALSE(axis_healthy(&axis));
    axis_receive(&axis, &good, 0);
    TEST_ASSERT_TRUE(axis_healthy(&axis));
    axis.was_enabled = true;
    TEST_ASSERT_FALSE(axis_left_operation_enabled(&axis));
    axis_restarted(&axis);
    TEST_ASSERT_FALSE(axis_healthy(&axis));
    TEST_ASSERT_FALSE(axis_enabled(&axis));
    TEST_ASSERT_TRUE(axis_left_operation_enabled(&axis));
}

/* The clock wraps in between. */
static void test_gone_is_lost_for_long(void)
{
    const uint32_t last_us = UINT32_MAX - 10u;
    answer(CIA402_SWITCHED_ON, 0, last_us);
    TEST_ASSERT_FALSE(axis_lost_for_long(&axis, last_us + 5u * AXIS_LOST_FOR_LONG_US));
    axis.tpdo1.lost = true;
    TEST_ASSERT_FALSE(axis_lost_for_long(&axis, last_us + AXIS_LOST_FOR_LONG_US));
    TEST_ASSERT_TRUE(axis_lost_for_long(&axis, last_us + AXIS_LOST_FOR_LONG_US + 1u));
    answer(CIA402_SWITCHED_ON, 0, last_us + 2u * AXIS_LOST_FOR_LONG_US);
    TEST_ASSERT_FALSE(axis_lost_for_long(&axis, last_us + 2u * AXIS_LOST_FOR_LONG_US));
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
    RUN_TEST(test_target_follows_until_the_drive_is_seen_enabled);
    RUN_TEST(test_the_target_of_a_drive_that_comes_on_is_inside_the_travel);
    RUN_TEST(test_a_quick_stop_takes_the_target_that_was_sent);
    RUN_TEST(test_a_statusword_that_lies_once_does_not_move_the_target);
    RUN_TEST(test_a_quick_stop_leaves_the_target_until_the_drive_is_off);
    RUN_TEST(test_a_garbled_statusword_has_to_come_twice_to_mean_stopped);
    RUN_TEST(test_homing_adds_its_bits_and_follows_the_position);
    RUN_TEST(test_enabled_means_that_the_target_is_followed);
    RUN_TEST(test_switching_off_lets_the_target_follow_again);
    RUN_TEST(test_standstill_needs_250_syncs_at_the_target);
    RUN_TEST(test_a_drive_that_is_off_does_not_stand_still);
    RUN_TEST(test_the_kept_frame_is_the_whole_setpoint);
    RUN_TEST(test_well_ends_with_a_restart_with_a_loss_and_with_trouble_that_stays);
    RUN_TEST(test_gone_is_lost_for_long);
    RUN_TEST(test_distance_is_that_of_the_farther_one_without_overflow);
    return UNITY_END();
}
