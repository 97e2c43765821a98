/* SPDX-License-Identifier: MIT */
/* Tests of app/machine/statusword_monitor.h: bits of a drive's statusword in addition to those of the state, while
 * it is in Operation enabled. Run by `make unit`; no I/O. */
#include "app/machine/statusword_monitor.h"

#include "app/machine/fault.h"
#include "canopen/cia402.h"
#include "unity.h"

#define GOOD (0x0027u | CIA402_STATUS_VOLTAGE | CIA402_STATUS_REMOTE | CIA402_STATUS_FOLLOWS)

static struct statusword_monitor watch;

void setUp(void)
{
    statusword_monitor_init(&watch);
    statusword_monitor_take(&watch, GOOD, true);
}

void tearDown(void)
{
}

/* The trouble after so many answers with this statusword, one by one. */
static void expect_trouble(unsigned statusword, uint16_t code, bool follows)
{
    for (unsigned i = 0; i < STATUSWORD_MONITOR_TOLERATED; ++i) {
        statusword_monitor_take(&watch, (uint16_t)statusword, true);
        TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, statusword_monitor_trouble(&watch));
        TEST_ASSERT_TRUE(statusword_monitor_follows(&watch));
    }
    statusword_monitor_take(&watch, (uint16_t)statusword, true);
    TEST_ASSERT_EQUAL_HEX16(code, statusword_monitor_trouble(&watch));
    TEST_ASSERT_EQUAL_INT(follows, statusword_monitor_follows(&watch));
}

static void test_each_bit_that_goes(void)
{
    expect_trouble(GOOD & ~CIA402_STATUS_VOLTAGE, EMCY_DC_UNDERVOLTAGE, false);
    setUp();
    expect_trouble(GOOD & ~CIA402_STATUS_REMOTE, FAULT_NOT_REMOTE, false);
    setUp();
    expect_trouble(GOOD & ~CIA402_STATUS_FOLLOWS, FAULT_NOT_FOLLOWING, false);
    setUp();
    expect_trouble(GOOD | CIA402_STATUS_FOLLOWING_ERROR, EMCY_FOLLOWING_ERROR, true);
    setUp();
    expect_trouble(GOOD & ~(CIA402_STATUS_VOLTAGE | CIA402_STATUS_FOLLOWS), EMCY_DC_UNDERVOLTAGE,
                   false);
}

static void test_limit_and_warning_are_no_trouble(void)
{
    expect_trouble(GOOD | CIA402_STATUS_LIMIT | CIA402_STATUS_WARNING, EMCY_NO_ERROR, true);
}

static void test_good_answers_in_between_start_the_count_anew(void)
{
    for (unsigned i = 0; i < 20; ++i) {
        for (unsigned k = 0; k < STATUSWORD_MONITOR_TOLERATED; ++k) {
            statusword_monitor_take(&watch, GOOD & (uint16_t)~CIA402_STATUS_REMOTE, true);
        }
        statusword_monitor_take(&watch, GOOD, true);
    }
    TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, statusword_monitor_trouble(&watch));
}

/* A drive without the bit cannot lose it. */
static void test_a_bit_never_seen_is_not_missed(void)
{
    statusword_monitor_init(&watch);
    expect_trouble(GOOD & ~CIA402_STATUS_VOLTAGE, EMCY_NO_ERROR, true);
}

static void test_while_homing_bits_12_and_13_mean_something_else(void)
{
    const uint16_t homing =
        (uint16_t)((GOOD & ~CIA402_STATUS_FOLLOWS) | CIA402_STATUS_FOLLOWING_ERROR);
    for (unsigned i = 0; i < 2u * STATUSWORD_MONITOR_TOLERATED; ++i) {
        statusword_monitor_take(&watch, homing, false);
    }
    TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, statusword_monitor_trouble(&watch));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_bit_that_goes);
    RUN_TEST(test_limit_and_warning_are_no_trouble);
    RUN_TEST(test_good_answers_in_between_start_the_count_anew);
    RUN_TEST(test_a_bit_never_seen_is_not_missed);
    RUN_TEST(test_while_homing_bits_12_and_13_mean_something_else);
    return UNITY_END();
}
