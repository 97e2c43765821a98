/* SPDX-License-Identifier: MIT */
/* Tests of gateway/pacing.h: when a request of the emulated board is answered, so that its ticks come as those of
 * the Linux port do (port/linux/schedule.h). Run by `make unit`; opens a pair of sockets. */
#include "gateway/pacing.h"

#include <string.h>

#include "unity.h"

#define MS 1000000ull

static struct pacing turn;
static struct exchange_header reply;
static uint64_t now_ns;

void setUp(void)
{
    memset(&turn, 0, sizeof turn);
    now_ns = 1000u * MS;
}

void tearDown(void)
{
}

static void request(unsigned flags)
{
    const struct exchange_header header = {
        .flags = (uint16_t)flags, .period_us = 1000, .guard_us = 100000};
    pacing_request(&turn, &header, now_ns);
}

static bool over(uint32_t frames)
{
    return pacing_over(&turn, frames, now_ns, &reply);
}

/* Waits as the gateway does, without frames. Returns for how long. */
static uint64_t wait_out(void)
{
    const uint64_t began_ns = now_ns;
    while (!over(0)) {
        const uint64_t wait_ns = pacing_wait_ns(&turn, now_ns);
        TEST_ASSERT_GREATER_THAN_UINT64(0, wait_ns);
        now_ns += wait_ns;
    }
    return now_ns - began_ns;
}

static void test_filters_and_the_end_are_answered_at_once(void)
{
    request(EXCHANGE_FILTER);
    TEST_ASSERT_EQUAL_UINT64(0, pacing_wait_ns(&turn, now_ns));
    TEST_ASSERT_TRUE(over(0));
    TEST_ASSERT_EQUAL_UINT16(0, reply.flags);
    request(EXCHANGE_END);
    TEST_ASSERT_TRUE(over(0));
}

static void test_ticks_that_await_nobody_follow_the_clock(void)
{
    request(EXCHANGE_TICK);
    (void)wait_out();
    const uint64_t began_ns = now_ns;
    for (int i = 0; i < 1000; ++i) {
        now_ns += MS / 10u;
        request(EXCHANGE_TICK);
        TEST_ASSERT_FALSE(over(3));
        (void)wait_out();
        TEST_ASSERT_EQUAL_UINT16(EXCHANGE_DUE, reply.flags);
        TEST_ASSERT_EQUAL_UINT32(0, reply.late_ns);
    }
    TEST_ASSERT_EQUAL_UINT64(1000u * MS, now_ns - began_ns);
}

static void test_a_late_board_gets_its_lateness(void)
{
    request(EXCHANGE_TICK);
    (void)wait_out();
    request(EXCHANGE_TICK);
    now_ns += 3u * MS;
    TEST_ASSERT_EQUAL_UINT64(0, pacing_wait_ns(&turn, now_ns));
    TEST_ASSERT_TRUE(over(0));
    TEST_ASSERT_EQUAL_UINT16(EXCHANGE_DUE, reply.flags);
    TEST_ASSERT_EQUAL_UINT32(2u * MS, reply.late_ns);
}

static void test_frames_are_handed_on_while_they_are_awaited(void)
{
    request(EXCHANGE_TICK | EXCHANGE_AWAIT);
    TEST_ASSERT_FALSE(over(0));
    TEST_ASSERT_TRUE(over(1));
    TEST_ASSERT_EQUAL_UINT16(0, reply.flags);
    request(EXCHANGE_AWAIT);
    TEST_ASSERT_FALSE(over(0));
    TEST_ASSERT_TRUE(over(2));
}

static void test_without_answers_the_guard_time_passes(void)
{
    request(EXCHANGE_TICK | EXCHANGE_AWAIT);
    TEST_ASSERT_EQUAL_UINT64(100u * MS, wait_out());
    TEST_ASSERT_EQUAL_UINT16(EXCHANGE_DUE, reply.flags);
}

static void test_a_stall_hardly_counts_as_guard_time(void)
{
    request(EXCHANGE_TICK | EXCHANGE_AWAIT);
    now_ns += 500u * MS;
    TEST_ASSERT_FALSE(over(0));
    TEST_ASSERT_EQUAL_UINT64(80u * MS, wait_out());
}

static void test_after_the_answers_the_clock_is_waited_for(void)
{
    request(EXCHANGE_TICK | EXCHANGE_AWAIT);
    now_ns += MS / 4u;
    TEST_ASSERT_TRUE(over(2));
    request(EXCHANGE_READY);
    TEST_ASSERT_FALSE(over(1));
    TEST_ASSERT_EQUAL_UINT64(MS * 3u / 4u, wait_out());
    TEST_ASSERT_EQUAL_UINT16(EXCHANGE_DUE, reply.flags);
}

static void test_at_lock_step_the_board_goes_on_by_itself(void)
{
    for (int i = 0; i < 100; ++i) {
        request(EXCHANGE_TICK | EXCHANGE_AWAIT | EXCHANGE_HURRY);
        TEST_ASSERT_FALSE(over(0));
        now_ns += MS / 20u;
        TEST_ASSERT_TRUE(over(2));
        TEST_ASSERT_EQUAL_UINT16(0, reply.flags);
    }
    request(EXCHANGE_TICK | EXCHANGE_AWAIT | EXCHANGE_HURRY);
    TEST_ASSERT_EQUAL_UINT64(100u * MS, wait_out());
    TEST_ASSERT_EQUAL_UINT16(EXCHANGE_DUE, reply.flags);
}

static void test_a_message_is_one_write_of_a_pipe(void)
{
    const struct exchange_message full = {.header = {.count = EXCHANGE_FRAMES}};
    TEST_ASSERT_EQUAL_UINT32(4096, exchange_size(&full));
    TEST_ASSERT_EQUAL_UINT32(sizeof full, exchange_size(&full));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_filters_and_the_end_are_answered_at_once);
    RUN_TEST(test_ticks_that_await_nobody_follow_the_clock);
    RUN_TEST(test_a_late_board_gets_its_lateness);
    RUN_TEST(test_frames_are_handed_on_while_they_are_awaited);
    RUN_TEST(test_without_answers_the_guard_time_passes);
    RUN_TEST(test_a_stall_hardly_counts_as_guard_time);
    RUN_TEST(test_after_the_answers_the_clock_is_waited_for);
    RUN_TEST(test_at_lock_step_the_board_goes_on_by_itself);
    RUN_TEST(test_a_message_is_one_write_of_a_pipe);
    return UNITY_END();
}
