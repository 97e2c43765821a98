/* SPDX-License-Identifier: MIT */
/* Who gets the next grant, and when time advances. Run by `make unit`; no I/O. */
#include "hub/virtual_time.h"
#include "unity.h"

static struct virtual_time time_;
static uint32_t a, b, c;

static uint64_t at(uint64_t ns)
{
    return VIRTUAL_TIME_BEGIN_NS + ns;
}

static void wait(uint32_t number, uint64_t until_ns)
{
    const struct participant *who = virtual_time_find(&time_, number);
    TEST_ASSERT_NOT_NULL(who);
    TEST_ASSERT_FALSE(virtual_time_wait(&time_, number, who->grant, until_ns, false));
}

static uint32_t granted(void)
{
    const struct participant *next = virtual_time_grant(&time_);
    return next != NULL ? next->number : 0u;
}

void setUp(void)
{
    virtual_time_init(&time_);
    b = virtual_time_join(&time_, "b", false);
    c = virtual_time_join(&time_, "c", false);
    a = virtual_time_join(&time_, "a", false);
}

void tearDown(void)
{
}

static void test_time_is_held_until_all_wait(void)
{
    wait(a, at(10));
    wait(b, at(20));
    TEST_ASSERT_TRUE(virtual_time_is_held(&time_));
    wait(c, at(5));
    TEST_ASSERT_FALSE(virtual_time_is_held(&time_));
    TEST_ASSERT_EQUAL_UINT64(at(5), virtual_time_next_ns(&time_));
    TEST_ASSERT_EQUAL_UINT32(0, granted()); /* nobody is due yet */
}

static void test_grants_in_the_order_of_names(void)
{
    wait(c, at(0));
    wait(b, at(0));
    wait(a, at(0));
    TEST_ASSERT_EQUAL_UINT32(a, granted());
    wait(a, at(9));
    TEST_ASSERT_EQUAL_UINT32(b, granted());
    wait(b, at(9));
    TEST_ASSERT_EQUAL_UINT32(c, granted());
    wait(c, at(9));
    TEST_ASSERT_EQUAL_UINT32(0, granted());
}

static void test_among_equal_names_the_first_comer(void)
{
    const uint32_t second = virtual_time_join(&time_, "b", false);
    wait(a, at(9));
    wait(c, at(9));
    wait(second, at(0));
    wait(b, at(0));
    TEST_ASSERT_EQUAL_UINT32(b, granted());
}

static void test_a_wake_comes_before_its_time(void)
{
    wait(a, at(9));
    wait(b, LOCAL_BUS_NEVER);
    wait(c, LOCAL_BUS_NEVER);
    virtual_time_wake(&time_, c);
    TEST_ASSERT_EQUAL_UINT32(c, granted());
    virtual_time_wake(&time_, c); /* it is active: it will not miss what it is woken for */
    wait(c, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL_UINT32(c, granted());
    wait(c, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL_UINT32(0, granted());
    TEST_ASSERT_EQUAL_UINT64(at(9), virtual_time_next_ns(&time_));
}

static void test_a_second_wait_ends_the_first(void)
{
    wait(a, LOCAL_BUS_NEVER);
    wait(b, LOCAL_BUS_NEVER);
    wait(c, LOCAL_BUS_NEVER);
    const uint32_t grant = virtual_time_find(&time_, b)->grant;
    TEST_ASSERT_TRUE(virtual_time_wait(&time_, b, grant, 0, false));
    TEST_ASSERT_EQUAL_UINT32(b, granted());
    /* One that crossed with the grant belongs to the older one: b stays active. */
    TEST_ASSERT_FALSE(virtual_time_wait(&time_, b, grant, 0, false));
    TEST_ASSERT_TRUE(virtual_time_is_held(&time_));
}

static void test_who_is_suspended_gets_nothing_until_it_continues(void)
{
    wait(a, at(0));
    wait(b, at(7));
    wait(c, LOCAL_BUS_NEVER);
    virtual_time_named(&time_, "a")->suspended = true;
    virtual_time_wake(&time_, a);
    TEST_ASSERT_EQUAL_UINT32(0, granted());
    TEST_ASSERT_EQUAL_UINT64(at(7), virtual_time_next_ns(&time_));
    virtual_time_named(&time_, "a")->suspended = false;
    TEST_ASSERT_EQUAL_UINT32(a, granted());
}

static void test_who_leaves_is_waited_for_no_more(void)
{
    wait(a, at(3));
    wait(c, at(4));
    TEST_ASSERT_TRUE(virtual_time_is_held(&time_));
    virtual_time_leave(&time_, b);
    TEST_ASSERT_FALSE(virtual_time_is_held(&time_));
    TEST_ASSERT_NULL(virtual_time_find(&time_, b));
    TEST_ASSERT_NULL(virtual_time_named(&time_, "b"));
    virtual_time_leave(&time_, b); /* twice is harmless */
    TEST_ASSERT_EQUAL_size_t(2, time_.count);
    TEST_ASSERT_EQUAL_STRING("a", virtual_time_find(&time_, a)->name);
    TEST_ASSERT_EQUAL_STRING("c", virtual_time_find(&time_, c)->name);
}

static void test_a_full_house(void)
{
    for (size_t i = 3; i < VIRTUAL_TIME_PARTICIPANTS; ++i) {
        TEST_ASSERT_NOT_EQUAL(0, virtual_time_join(&time_, "more", false));
    }
    TEST_ASSERT_EQUAL_UINT32(0, virtual_time_join(&time_, "too many", false));
    TEST_ASSERT_EQUAL_size_t(VIRTUAL_TIME_PARTICIPANTS, time_.count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_time_is_held_until_all_wait);
    RUN_TEST(test_grants_in_the_order_of_names);
    RUN_TEST(test_among_equal_names_the_first_comer);
    RUN_TEST(test_a_wake_comes_before_its_time);
    RUN_TEST(test_a_second_wait_ends_the_first);
    RUN_TEST(test_who_is_suspended_gets_nothing_until_it_continues);
    RUN_TEST(test_who_leaves_is_waited_for_no_more);
    RUN_TEST(test_a_full_house);
    return UNITY_END();
}
