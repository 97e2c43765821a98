/* SPDX-License-Identifier: MIT */
/* Tests of injector/delay_queue.h: frames that go out later. Run by `make unit`; no I/O. */
#include "injector/delay_queue.h"

#include <string.h>

#include "unity.h"

static struct delay_queue queue;

void setUp(void)
{
    memset(&queue, 0, sizeof queue);
}

void tearDown(void)
{
}

static bool put(uint32_t id, uint64_t due_ns)
{
    const struct can_msg frame = {.id = id, .len = 1, .data = {(uint8_t)id}};
    return delay_queue_put(&queue, id % 2u == 0u ? FAULT_SIDE_DRIVES : FAULT_SIDE_CONTROLLER,
                           &frame, due_ns);
}

static void expect(uint32_t id, uint64_t now_ns)
{
    struct delayed_frame out;
    TEST_ASSERT_TRUE(delay_queue_take(&queue, now_ns, &out));
    TEST_ASSERT_EQUAL_HEX32(id, out.frame.id);
    TEST_ASSERT_EQUAL_HEX8(id, out.frame.data[0]);
    TEST_ASSERT_EQUAL_INT(id % 2u == 0u ? FAULT_SIDE_DRIVES : FAULT_SIDE_CONTROLLER, out.to);
}

static void test_frames_go_in_the_order_of_their_times(void)
{
    struct delayed_frame out;
    TEST_ASSERT_EQUAL_UINT64(UINT64_MAX, delay_queue_due_ns(&queue));
    TEST_ASSERT_TRUE(put(5, 50) && put(1, 10) && put(4, 40) && put(2, 20) && put(3, 40));
    TEST_ASSERT_EQUAL_UINT64(10, delay_queue_due_ns(&queue));
    TEST_ASSERT_FALSE(delay_queue_take(&queue, 9, &out));
    expect(1, 10);
    expect(2, 100);
    expect(4, 100); /* due at the same instant: in the order in which they came */
    expect(3, 100);
    TEST_ASSERT_FALSE(delay_queue_take(&queue, 49, &out));
    expect(5, 50);
    TEST_ASSERT_FALSE(delay_queue_take(&queue, UINT64_MAX - 1u, &out));
}

static void test_a_full_queue_takes_nothing_and_loses_nothing(void)
{
    for (uint32_t i = DELAY_QUEUE_FRAMES; i-- > 0u;) {
        TEST_ASSERT_TRUE(put(i, i));
    }
    TEST_ASSERT_FALSE(put(0x7FF, 0));
    for (uint32_t i = 0; i < DELAY_QUEUE_FRAMES; i++) {
        expect(i, i);
    }
    TEST_ASSERT_TRUE(put(1, 1));
    expect(1, 1);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_go_in_the_order_of_their_times);
    RUN_TEST(test_a_full_queue_takes_nothing_and_loses_nothing);
    return UNITY_END();
}
