/* SPDX-License-Identifier: MIT */
/* The signals of the gateway: each of them asks the board to end, SIGHUP also if it comes twice. Run by `make unit`;
 * sends signals to its own process. */
#define _GNU_SOURCE
#include "gateway/bus.h"

#include <signal.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_an_ignored_hang_up_stays_ignored(void)
{
    (void)signal(SIGHUP, SIG_IGN); /* nohup */
    TEST_ASSERT_EQUAL_INT(0, bus_catch_signals());
    (void)raise(SIGHUP);
    TEST_ASSERT_EQUAL_UINT(0, bus_signals());
    (void)signal(SIGHUP, SIG_DFL);
}

/* The shell and the kernel may each send one. The second signal would end the gateway before the axes stand. */
static void test_two_hang_ups_count_as_one_signal(void)
{
    TEST_ASSERT_EQUAL_INT(0, bus_catch_signals());
    (void)raise(SIGHUP);
    (void)raise(SIGHUP);
    TEST_ASSERT_EQUAL_UINT(1, bus_signals());
    (void)raise(SIGTERM);
    TEST_ASSERT_EQUAL_UINT(2, bus_signals());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_ignored_hang_up_stays_ignored);
    RUN_TEST(test_two_hang_ups_count_as_one_signal);
    return UNITY_END();
}
