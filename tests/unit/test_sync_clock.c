/* SPDX-License-Identifier: MIT */
/* Tests of node/sync_clock.h: the time base of a simulated drive. Run by `make unit`; no I/O. */
#include "node/sync_clock.h"

#include <string.h>

#include "canopen/cob.h"
#include "unity.h"

enum { OVERFLOW = 240, TIMEOUT_US = 50000 };

static struct sync_clock base;

void setUp(void)
{
    memset(&base, 0, sizeof base);
    sync_clock_reset_counter(&base, OVERFLOW);
}

void tearDown(void)
{
}

static int sync(uint8_t counter)
{
    struct can_msg frame;
    cob_frame(&frame, COB_SYNC, 1);
    frame.data[0] = counter;
    return sync_clock_receive(&base, &frame, OVERFLOW);
}

static bool lost_after(uint32_t elapsed_us)
{
    return sync_clock_process(&base, elapsed_us, TIMEOUT_US, false);
}

static void test_periods_are_those_of_the_counter(void)
{
    TEST_ASSERT_EQUAL_INT(1, sync(7));
    TEST_ASSERT_EQUAL_INT(1, sync(8));
    TEST_ASSERT_EQUAL_INT(0, sync(8));
    TEST_ASSERT_EQUAL_INT(3, sync(11));
    TEST_ASSERT_EQUAL_INT(SYNC_ERR_COUNTER, sync(0));
    TEST_ASSERT_EQUAL_INT(1, sync(12));
}

static void test_the_timeout_is_exceeded_once(void)
{
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    TEST_ASSERT_TRUE(lost_after(1));
    TEST_ASSERT_TRUE(base.lost);
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US + 1));
}

/* Time before a SYNC that came meanwhile does not count; a repeated one is a SYNC, too, one without counter is none. */
static void test_sync_starts_the_timeout_again(void)
{
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    (void)sync(1);
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US + 1));
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    (void)sync(1);
    TEST_ASSERT_FALSE(lost_after(1));
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    (void)sync(0);
    TEST_ASSERT_TRUE(lost_after(1));
}

static void test_a_stopped_node_expects_no_sync(void)
{
    TEST_ASSERT_TRUE(sync_clock_process(&base, 0, TIMEOUT_US, true));
    TEST_ASSERT_FALSE(sync_clock_process(&base, 0, TIMEOUT_US, true));
}

/* The counter after a loss is a new beginning, and the timeout counts from there. */
static void test_sync_comes_back(void)
{
    (void)sync(1);
    TEST_ASSERT_FALSE(lost_after(0));
    TEST_ASSERT_TRUE(lost_after(TIMEOUT_US + 1));
    TEST_ASSERT_EQUAL_INT(1, sync(100));
    TEST_ASSERT_FALSE(base.lost);
    TEST_ASSERT_EQUAL_INT(2, sync(102));
}

static void test_await_ends_a_loss_and_keeps_the_counter(void)
{
    (void)sync(1);
    TEST_ASSERT_FALSE(lost_after(0));
    TEST_ASSERT_TRUE(lost_after(TIMEOUT_US + 1));
    sync_clock_await(&base);
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    TEST_ASSERT_EQUAL_INT(4, sync(5));
}

static void test_await_starts_the_timeout_again(void)
{
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
    sync_clock_await(&base);
    TEST_ASSERT_FALSE(lost_after(TIMEOUT_US));
}

static void test_whole_periods_of_the_wall_clock(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, sync_clock_own_periods(&base, 999, 1000));
    TEST_ASSERT_EQUAL_UINT32(1, sync_clock_own_periods(&base, 1, 1000));
    TEST_ASSERT_EQUAL_UINT32(2, sync_clock_own_periods(&base, 2999, 1000));
    TEST_ASSERT_EQUAL_UINT32(1, sync_clock_own_periods(&base, 1, 1000));
    (void)sync_clock_own_periods(&base, 500, 1000);
    TEST_ASSERT_TRUE(lost_after(TIMEOUT_US + 1)); /* what was left does not count */
    TEST_ASSERT_EQUAL_UINT32(0, sync_clock_own_periods(&base, 999, 1000));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_periods_are_those_of_the_counter);
    RUN_TEST(test_the_timeout_is_exceeded_once);
    RUN_TEST(test_sync_starts_the_timeout_again);
    RUN_TEST(test_a_stopped_node_expects_no_sync);
    RUN_TEST(test_sync_comes_back);
    RUN_TEST(test_await_ends_a_loss_and_keeps_the_counter);
    RUN_TEST(test_await_starts_the_timeout_again);
    RUN_TEST(test_whole_periods_of_the_wall_clock);
    return UNITY_END();
}
