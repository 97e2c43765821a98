/* SPDX-License-Identifier: MIT */
/* Tests of port/linux/schedule.h: when the next tick is due. Run by `make unit`; no I/O. */
#include "port/linux/schedule.h"

#include "unity.h"

#define MS 1000000u

static struct schedule schedule;

void setUp(void)
{
    schedule_begin(&schedule, 100u * MS, MS, false);
}

void tearDown(void)
{
}

/* Runs the tick that is due, late_ns late; returns the lateness reported. */
static uint64_t tick(uint64_t late_ns)
{
    const uint64_t now_ns = schedule.due_ns + late_ns;
    const uint64_t told_ns = schedule_start(&schedule, now_ns);
    schedule_finish(&schedule, now_ns);
    return told_ns;
}

static void test_small_lateness_does_not_add_up(void)
{
    for (unsigned k = 0; k < 1000; ++k) {
        TEST_ASSERT_EQUAL_UINT64(200000, tick(200000));
    }
    TEST_ASSERT_EQUAL_UINT64(1101u * (uint64_t)MS, schedule.due_ns);
}

static void test_a_late_tick_is_followed_at_three_quarters_of_a_period_at_least(void)
{
    const uint64_t start_ns = schedule.due_ns + 600000u;
    TEST_ASSERT_EQUAL_UINT64(600000, tick(600000));
    TEST_ASSERT_EQUAL_UINT64(start_ns + 3u * MS / 4u, schedule.due_ns);
}

/* 0.9 ms late: 0.65 ms of it remain after one tick, then 0.4, 0.15, none. */
static void test_lateness_is_made_up(void)
{
    const uint64_t due_ns = schedule.due_ns;
    TEST_ASSERT_EQUAL_UINT64(900000, tick(900000));
    TEST_ASSERT_EQUAL_UINT64(650000, tick(0));
    TEST_ASSERT_EQUAL_UINT64(400000, tick(0));
    TEST_ASSERT_EQUAL_UINT64(150000, tick(0));
    TEST_ASSERT_EQUAL_UINT64(0, tick(0));
    TEST_ASSERT_EQUAL_UINT64(due_ns + 5u * MS, schedule.due_ns);
}

static void test_after_a_miss_the_clock_is_set_anew(void)
{
    const uint64_t start_ns = schedule.due_ns + 3u * MS;
    TEST_ASSERT_EQUAL_UINT64(3u * MS, tick(3u * MS));
    TEST_ASSERT_EQUAL_UINT64(start_ns + MS, schedule.due_ns);
    TEST_ASSERT_EQUAL_UINT64(0, tick(0));
}

static void test_who_is_not_ready_in_time_makes_the_tick_late(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, true);
    schedule_finish(&schedule, start_ns);
    TEST_ASSERT_EQUAL_UINT64(start_ns + 100u * MS, schedule.due_ns);
    schedule_ready(&schedule, start_ns + MS / 2u);
    TEST_ASSERT_EQUAL_UINT64(start_ns + MS, schedule.due_ns);
    TEST_ASSERT_EQUAL_UINT64(2u * MS, tick(2u * MS));
}

/* Two thirds of the time at most: the remainder is for the main loop. */
static void test_a_slow_machine_rests_half_of_what_it_worked(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns + MS);
    schedule_ready(&schedule, start_ns + 4u * MS);
    TEST_ASSERT_EQUAL_UINT64(start_ns + 6u * MS, schedule.due_ns);
    (void)schedule_start(&schedule, schedule.due_ns);
    const uint64_t next_ns = schedule.due_ns;
    schedule_finish(&schedule, next_ns + 2u * MS);
    TEST_ASSERT_EQUAL_UINT64(next_ns + 3u * MS, schedule.due_ns);
}

/* Answers of real drives take bus time, no processor; of a flood of answers only the first one counts. */
static void test_who_is_not_waited_for_delays_nothing(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)tick(0);
    schedule_ready(&schedule, start_ns + 9u * MS / 10u);
    TEST_ASSERT_EQUAL_UINT64(start_ns + MS, schedule.due_ns);
    (void)schedule_start(&schedule, schedule.due_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns + MS);
    for (uint64_t tenth = 5; tenth < 100u; ++tenth) {
        schedule_ready(&schedule, start_ns + MS + tenth * MS / 10u);
        TEST_ASSERT_EQUAL_UINT64(start_ns + 2u * MS, schedule.due_ns);
    }
}

static void test_the_rest_after_a_stall_is_short(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns);
    schedule_ready(&schedule, start_ns + 900u * MS);
    TEST_ASSERT_EQUAL_UINT64(start_ns + 910u * MS, schedule.due_ns);
}

static void test_whoever_is_never_ready_is_left_after_the_guard(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns);
    TEST_ASSERT_EQUAL_UINT64(99u * MS, tick(0));
    TEST_ASSERT_EQUAL_UINT64(start_ns + 101u * MS, schedule.due_ns);
}

/* Wakes every 10 ms: all of it counts, whatever frames come in between. */
static void test_the_guard_is_counted_in_slices(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns);
    for (uint64_t ms = 10; ms < 100; ms += 10) {
        schedule_wait(&schedule, start_ns + ms * MS);
        TEST_ASSERT_EQUAL_UINT64(start_ns + 100u * MS, schedule.due_ns);
    }
}

static void test_a_stall_counts_as_one_slice_of_20_ms(void)
{
    const uint64_t start_ns = schedule.due_ns;
    (void)schedule_start(&schedule, start_ns);
    schedule_await(&schedule, 100u * MS, false);
    schedule_finish(&schedule, start_ns);
    schedule_wait(&schedule, start_ns + 5000u * (uint64_t)MS);
    TEST_ASSERT_EQUAL_UINT64(start_ns + 5080u * (uint64_t)MS, schedule.due_ns);
    schedule_wait(&schedule, start_ns + 5080u * (uint64_t)MS);
    TEST_ASSERT_EQUAL_UINT64(start_ns + 5140u * (uint64_t)MS, schedule.due_ns);
    schedule_ready(&schedule, start_ns + 5090u * (uint64_t)MS);
    const uint64_t due_ns = schedule.due_ns;
    schedule_wait(&schedule, start_ns + 5100u * (uint64_t)MS);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(due_ns, schedule.due_ns, "nobody is waited for any more");
}

/* Whether the tick that is due is put off; the main loop has had `had_ns` of the processor. */
static bool put_off(uint64_t now_ns, uint32_t sleeps, uint64_t had_ns)
{
    return schedule_overdue(&schedule, now_ns, sleeps) && schedule_yield(&schedule, now_ns, had_ns);
}

static void test_a_main_loop_that_sleeps_now_and_then_delays_nothing(void)
{
    for (uint32_t k = 1; k < 1000u; ++k) {
        TEST_ASSERT_FALSE(put_off(schedule.due_ns, k / 10u, 0));
        (void)tick(0);
    }
}

static void test_a_main_loop_that_computes_delays_nothing(void)
{
    for (uint32_t k = 1; k < 1000u; ++k) {
        const uint64_t now_ns = schedule.due_ns;
        TEST_ASSERT_FALSE(put_off(now_ns, 1, now_ns / SCHEDULE_MAIN_LOOP_SHARE));
        (void)tick(0);
    }
}

/* Ticks until the first one that is put off. */
static void starve(void)
{
    uint32_t ticks = 0;
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 1, 0));
    while (!put_off(schedule.due_ns, 1, 0)) {
        (void)tick(0);
        TEST_ASSERT_TRUE_MESSAGE(++ticks < 30u, "nobody yields");
    }
    TEST_ASSERT_TRUE(ticks > SCHEDULE_SLEEPLESS_NS / MS);
}

static void test_a_starved_main_loop_gets_10_ms_before_each_tick(void)
{
    starve();
    for (unsigned ms = 1; ms < 10u; ++ms) {
        const uint64_t due_ns = schedule.due_ns;
        TEST_ASSERT_TRUE(put_off(due_ns, 1, 0));
        TEST_ASSERT_EQUAL_UINT64(due_ns + MS, schedule.due_ns);
    }
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 1, 0));
    (void)tick(0);
    TEST_ASSERT_TRUE_MESSAGE(put_off(schedule.due_ns, 1, 0), "and before the next one");
}

static void test_after_its_turn_the_main_loop_is_not_waited_for(void)
{
    starve();
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 2, 0));
    (void)tick(0);
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 2, 0));
}

/* 5 s without any processor: of the 10 ms two are gone. */
static void test_a_stall_is_no_time_for_the_main_loop(void)
{
    starve();
    const uint64_t now_ns = schedule.due_ns + 5000u * (uint64_t)MS;
    TEST_ASSERT_TRUE(put_off(now_ns, 1, 0));
    for (uint64_t ms = 1; ms < 8u; ++ms) {
        TEST_ASSERT_TRUE(put_off(now_ns + ms * MS, 1, 0));
    }
    TEST_ASSERT_FALSE(put_off(now_ns + 8u * (uint64_t)MS, 1, 0));
}

/* Nobody has to wait for it where drives are real. */
static void test_no_tick_is_put_off_for_real_drives(void)
{
    schedule_begin(&schedule, 0, 1000000u, false);
    (void)schedule_overdue(&schedule, 0, 1);
    TEST_ASSERT_TRUE(schedule_overdue(&schedule, SCHEDULE_SLEEPLESS_NS + 1u, 1));
    schedule.urgent = true;
    TEST_ASSERT_FALSE(schedule_overdue(&schedule, SCHEDULE_SLEEPLESS_NS + 1u, 1));
}

static void test_a_main_loop_that_is_stuck_is_left(void)
{
    unsigned yields = 0;
    starve();
    for (unsigned wake = 0; wake < 1000u; ++wake) {
        if (put_off(schedule.due_ns, 1, 0)) {
            yields++;
        } else {
            (void)tick(0);
        }
    }
    TEST_ASSERT_TRUE(yields >= 150u && yields <= SCHEDULE_YIELDS_NS / MS + 1u);
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 1, 0));
    TEST_ASSERT_FALSE(put_off(schedule.due_ns, 2, 0));
    starve();
}

static void lock_step_tick(bool await, bool hurry)
{
    const uint64_t now_ns = schedule.due_ns;
    (void)schedule_start(&schedule, now_ns);
    if (await) {
        schedule_await(&schedule, 100u * MS, hurry);
    }
    schedule_finish(&schedule, now_ns);
}

static void test_lock_step_in_a_hurry_is_due_when_all_are_ready(void)
{
    schedule_begin(&schedule, 0, MS, true);
    lock_step_tick(true, true);
    TEST_ASSERT_EQUAL_UINT64(101u * (uint64_t)MS, schedule.due_ns);
    schedule_ready(&schedule, 3u * MS);
    TEST_ASSERT_EQUAL_UINT64(MS, schedule.due_ns);
    TEST_ASSERT_EQUAL_UINT64(0, tick(5u * MS));
}

static void test_lock_step_without_hurry_goes_by_the_clock(void)
{
    schedule_begin(&schedule, 0, MS, true);
    lock_step_tick(true, false);
    schedule_ready(&schedule, MS + MS / 2u);
    TEST_ASSERT_EQUAL_UINT64(2u * MS, schedule.due_ns);
    lock_step_tick(false, false);
    TEST_ASSERT_EQUAL_UINT64(3u * MS, schedule.due_ns);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_small_lateness_does_not_add_up);
    RUN_TEST(test_a_late_tick_is_followed_at_three_quarters_of_a_period_at_least);
    RUN_TEST(test_lateness_is_made_up);
    RUN_TEST(test_after_a_miss_the_clock_is_set_anew);
    RUN_TEST(test_who_is_not_ready_in_time_makes_the_tick_late);
    RUN_TEST(test_a_slow_machine_rests_half_of_what_it_worked);
    RUN_TEST(test_who_is_not_waited_for_delays_nothing);
    RUN_TEST(test_the_rest_after_a_stall_is_short);
    RUN_TEST(test_whoever_is_never_ready_is_left_after_the_guard);
    RUN_TEST(test_the_guard_is_counted_in_slices);
    RUN_TEST(test_a_stall_counts_as_one_slice_of_20_ms);
    RUN_TEST(test_a_main_loop_that_sleeps_now_and_then_delays_nothing);
    RUN_TEST(test_a_main_loop_that_computes_delays_nothing);
    RUN_TEST(test_a_starved_main_loop_gets_10_ms_before_each_tick);
    RUN_TEST(test_after_its_turn_the_main_loop_is_not_waited_for);
    RUN_TEST(test_a_stall_is_no_time_for_the_main_loop);
    RUN_TEST(test_a_main_loop_that_is_stuck_is_left);
    RUN_TEST(test_no_tick_is_put_off_for_real_drives);
    RUN_TEST(test_lock_step_in_a_hurry_is_due_when_all_are_ready);
    RUN_TEST(test_lock_step_without_hurry_goes_by_the_clock);
    return UNITY_END();
}
