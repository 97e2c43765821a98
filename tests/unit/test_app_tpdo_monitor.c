/* SPDX-License-Identifier: MIT */
/* Tests of app/machine/tpdo_monitor.h: missed and late answers of a drive. Run by `make unit`; no I/O. */
#include "app/machine/tpdo_monitor.h"

#include "unity.h"

#define PERIOD_US 1000u

static struct tpdo_monitor monitor;
static uint32_t now_us;
static uint32_t wait_us;
static uint8_t missed_max;

void setUp(void)
{
    tpdo_monitor_init(&monitor);
    now_us = UINT32_MAX - 3u * PERIOD_US; /* soon to wrap */
    wait_us = 0;
    missed_max = 1;
}

void tearDown(void)
{
}

/* A SYNC, answered `count` times, and the next tick, which closes it. */
static uint32_t sync(unsigned count)
{
    const uint32_t sync_us = now_us;
    for (unsigned i = 0; i < count; ++i) {
        tpdo_monitor_take(&monitor, sync_us + 300u);
    }
    now_us += PERIOD_US;
    return tpdo_monitor_close_sync(&monitor, now_us, sync_us, wait_us, missed_max);
}

/* tpdo_monitor_close_answered, which the tick uses, has the effect of tpdo_monitor_close_sync whenever it returns true.
 * */
static void test_the_quick_end_of_a_sync_is_the_same_as_the_thorough_one(void)
{
    static const uint8_t counts[] = {1, 1, 0, 1, 2, 1, 0, 0, 3, 1, 1, 0, 0, 0, 1, 1, 2, 0, 1, 5, 1};
    uint32_t quick_ones = 0;
    wait_us = 2u * PERIOD_US;
    for (uint32_t i = 0; i < sizeof counts; ++i) {
        struct tpdo_monitor quick = monitor;
        for (unsigned k = 0; k < counts[i]; ++k) {
            tpdo_monitor_take(&quick, now_us + 300u);
        }
        const struct tpdo_monitor before = quick;
        const bool done = tpdo_monitor_close_answered(&quick);
        const uint32_t missed = sync(counts[i]);
        TEST_ASSERT_EQUAL_MEMORY(done ? &monitor : &before, &quick, sizeof quick);
        TEST_ASSERT_TRUE(!done || missed == 0u);
        quick_ones += done ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(quick_ones > 5u && quick_ones < sizeof counts - 5u); /* both have been tried */
}

static void test_nothing_is_missed_before_the_first_answer(void)
{
    for (unsigned i = 0; i < 20; ++i) {
        TEST_ASSERT_EQUAL_UINT32(0, sync(0));
    }
    TEST_ASSERT_FALSE(monitor.present);
    TEST_ASSERT_FALSE(monitor.lost);
}

static void test_without_patience_absent_is_missed(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    TEST_ASSERT_EQUAL_UINT32(1, sync(0));
    TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    TEST_ASSERT_EQUAL_UINT32(1, monitor.missed);
    TEST_ASSERT_FALSE(monitor.lost);
}

static void test_one_more_than_permitted_in_a_row_is_lost_until_the_next_answer(void)
{
    for (missed_max = 0; missed_max < 5; ++missed_max) {
        (void)sync(1);
        for (unsigned i = 0; i < missed_max; ++i) {
            TEST_ASSERT_EQUAL_UINT32(1, sync(0));
            TEST_ASSERT_FALSE(monitor.lost);
        }
        TEST_ASSERT_EQUAL_UINT32(1, sync(0));
        TEST_ASSERT_TRUE(monitor.lost);
        tpdo_monitor_take(&monitor, now_us);
        TEST_ASSERT_FALSE(monitor.lost);
    }
}

/* Absent, absent, then three at once: the drive was late. */
static void test_late_answers_are_not_counted(void)
{
    wait_us = 5000;
    (void)sync(1);
    TEST_ASSERT_EQUAL_UINT32(0, sync(0));
    TEST_ASSERT_EQUAL_UINT32(0, sync(0));
    TEST_ASSERT_EQUAL_UINT32(0, sync(3));
    for (unsigned i = 0; i < 20; ++i) {
        TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    }
    TEST_ASSERT_EQUAL_UINT32(0, monitor.missed);
}

/* Two absent, only one of them comes later. */
static void test_what_does_not_come_in_time_is_missed(void)
{
    wait_us = 5000;
    (void)sync(1);
    (void)sync(0);
    (void)sync(0);
    TEST_ASSERT_EQUAL_UINT32(0, sync(2)); /* that of the first */
    TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    TEST_ASSERT_EQUAL_UINT32(1, sync(1));
    for (unsigned i = 0; i < 20; ++i) {
        TEST_ASSERT_EQUAL_UINT32(0, sync(1));
    }
    TEST_ASSERT_EQUAL_UINT32(1, monitor.missed);
}

/* One is missed for good; another, four SYNCs later, comes late. */
static void test_each_absent_one_has_its_own_time(void)
{
    wait_us = 5000;
    (void)sync(1);
    (void)sync(0);
    for (unsigned i = 0; i < 3; ++i) {
        (void)sync(1);
    }
    TEST_ASSERT_EQUAL_UINT32(1, sync(0));
    (void)sync(2);
    for (unsigned i = 0; i < 20; ++i) {
        (void)sync(1);
    }
    TEST_ASSERT_EQUAL_UINT32(1, monitor.missed);
}

static void test_more_than_can_be_remembered_are_missed(void)
{
    wait_us = 100000;
    missed_max = 100;
    (void)sync(1);
    for (unsigned i = 0; i < TPDO_MONITOR_PENDING_MAX; ++i) {
        TEST_ASSERT_EQUAL_UINT32(0, sync(0));
    }
    TEST_ASSERT_EQUAL_UINT32(1, sync(0));
    TEST_ASSERT_EQUAL_UINT32(1, sync(0));
    (void)sync(1u + TPDO_MONITOR_PENDING_MAX);
    for (unsigned i = 0; i < 200; ++i) {
        (void)sync(1);
    }
    TEST_ASSERT_EQUAL_UINT32(2, monitor.missed);
}

static void test_lost_takes_the_patience_too(void)
{
    wait_us = 5000;
    (void)sync(1);
    for (unsigned i = 0; i < 4; ++i) {
        (void)sync(0);
        TEST_ASSERT_FALSE(monitor.lost);
    }
    (void)sync(0);
    TEST_ASSERT_TRUE(monitor.lost);
    TEST_ASSERT_EQUAL_UINT32(5, monitor.missed);
}

/* Doubled frames make up for nothing that is missed later. */
/* After 2^32 us the time since the last answer begins at 0 again. */
static void test_a_drive_that_is_lost_for_an_hour_stays_lost(void)
{
    wait_us = 5u * PERIOD_US;
    (void)sync(1);
    const uint32_t answered_us = now_us;
    for (unsigned i = 0; i < 10u; ++i) {
        (void)sync(0);
    }
    TEST_ASSERT_TRUE(monitor.lost);
    now_us = answered_us - 2u * PERIOD_US;
    for (unsigned i = 0; i < 10u; ++i) {
        (void)sync(0);
        TEST_ASSERT_TRUE(monitor.lost);
    }
    (void)sync(1);
    TEST_ASSERT_FALSE(monitor.lost);
}

static void test_a_doubled_answer_is_one(void)
{
    wait_us = 5000;
    (void)sync(2);
    (void)sync(2);
    (void)sync(0);
    for (unsigned i = 0; i < 6; ++i) {
        (void)sync(1);
    }
    TEST_ASSERT_EQUAL_UINT32(1, monitor.missed);
}

static void test_restart_keeps_the_presence_only(void)
{
    (void)sync(1);
    (void)sync(0);
    (void)sync(0);
    tpdo_monitor_restart(&monitor);
    TEST_ASSERT_TRUE(monitor.present);
    TEST_ASSERT_FALSE(monitor.lost);
    TEST_ASSERT_EQUAL_UINT32(0, monitor.missed);
    (void)sync(0);
    TEST_ASSERT_FALSE(monitor.lost);
    (void)sync(0);
    TEST_ASSERT_TRUE(monitor.lost);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_quick_end_of_a_sync_is_the_same_as_the_thorough_one);
    RUN_TEST(test_nothing_is_missed_before_the_first_answer);
    RUN_TEST(test_without_patience_absent_is_missed);
    RUN_TEST(test_one_more_than_permitted_in_a_row_is_lost_until_the_next_answer);
    RUN_TEST(test_late_answers_are_not_counted);
    RUN_TEST(test_what_does_not_come_in_time_is_missed);
    RUN_TEST(test_each_absent_one_has_its_own_time);
    RUN_TEST(test_more_than_can_be_remembered_are_missed);
    RUN_TEST(test_lost_takes_the_patience_too);
    RUN_TEST(test_a_drive_that_is_lost_for_an_hour_stays_lost);
    RUN_TEST(test_a_doubled_answer_is_one);
    RUN_TEST(test_restart_keeps_the_presence_only);
    return UNITY_END();
}
