/* SPDX-License-Identifier: MIT */
/* Tests of canopen/heartbeat.h: producer (0x1017) and consumer (0x1016). Run by `make unit`; no I/O. */
#include "canopen/heartbeat.h"

#include "canopen/cob.h"
#include "unity.h"

static struct heartbeat_producer producer;
static struct heartbeat_consumer consumer;
static struct can_msg out;

void setUp(void)
{
    heartbeat_producer_init(&producer, 4);
    heartbeat_consumer_init(&consumer, 4, 100);
}

void tearDown(void)
{
}

static int produce(uint32_t elapsed_us)
{
    return heartbeat_producer_process(&producer, 10, NMT_OPERATIONAL, elapsed_us, &out);
}

static enum heartbeat_event hear(uint8_t state)
{
    struct can_msg in;

    cob_frame(&in, COB_HEARTBEAT + 4, 1);
    in.data[0] = state;
    return heartbeat_consumer_receive(&consumer, &in);
}

static void test_produces_at_its_period(void)
{
    int frames = 0;

    for (int ms = 0; ms < 1000; ms++) {
        frames += produce(1000);
    }
    TEST_ASSERT_EQUAL_INT(100, frames);
    TEST_ASSERT_EQUAL_HEX32(0x704, out.id);
    TEST_ASSERT_EQUAL_UINT8(1, out.len);
    TEST_ASSERT_EQUAL_HEX8(NMT_OPERATIONAL, out.data[0]);
}

static void test_period_does_not_drift(void)
{
    int frames = 0;

    for (int i = 0; i < 10000; i++) {
        frames += produce(700);
    }
    TEST_ASSERT_EQUAL_INT(700, frames);
}

static void test_a_late_call_gives_one_frame(void)
{
    TEST_ASSERT_EQUAL_INT(1, produce(UINT32_MAX));
    TEST_ASSERT_EQUAL_INT(0, produce(0));
}

static void test_no_heartbeat_when_off_or_initialising(void)
{
    TEST_ASSERT_FALSE(heartbeat_producer_process(&producer, 0, NMT_OPERATIONAL, UINT32_MAX, &out));
    TEST_ASSERT_FALSE(heartbeat_producer_process(&producer, 10, NMT_INITIALISING, 10000, &out));
    TEST_ASSERT_EQUAL_INT(1, produce(10000));
}

static void test_consumer_follows_states(void)
{
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_BOOTED, hear(0));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_UNKNOWN, consumer.presence);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_CHANGED, hear(0x7F));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, hear(0x7F));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_CHANGED, hear(5));
    TEST_ASSERT_EQUAL_HEX8(NMT_OPERATIONAL, consumer.state);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_BOOTED, hear(0));
}

static void test_consumer_reports_a_loss_once(void)
{
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_process(&consumer, UINT32_MAX));
    hear(5);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_process(&consumer, 100000));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_LOST, heartbeat_consumer_process(&consumer, 1));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_MISSING, consumer.presence);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_process(&consumer, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_CHANGED, hear(5));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_PRESENT, consumer.presence);
}

static void test_each_heartbeat_restarts_the_time(void)
{
    for (int i = 0; i < 10; i++) {
        hear(5);
        TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_process(&consumer, 99999));
    }
}

static void test_consumer_ignores_others(void)
{
    struct can_msg in;

    cob_frame(&in, COB_HEARTBEAT + 5, 1);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_receive(&consumer, &in));
    cob_frame(&in, COB_HEARTBEAT + 4, 2);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, heartbeat_consumer_receive(&consumer, &in));
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_UNKNOWN, consumer.presence);
}

static void test_consumer_entry_of_0x1016(void)
{
    heartbeat_consumer_init_entry(&consumer, 0x000401F4);
    TEST_ASSERT_EQUAL_UINT8(4, consumer.node);
    TEST_ASSERT_EQUAL_UINT32(500000, consumer.time_us);
    heartbeat_consumer_init_entry(&consumer, 0);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_NOTHING, hear(5));
}

/* 0x1016: no node in two entries, whatever their times; entries without node or time do not count. */
static void test_a_node_is_monitored_by_one_entry_only(void)
{
    const uint32_t entries[] = {0x000501F4, 0, 0x00060000, 0x00071388};

    TEST_ASSERT_TRUE(heartbeat_entry_taken(entries, 4, 1, 0x000501F4));
    TEST_ASSERT_TRUE(heartbeat_entry_taken(entries, 4, 1, 0x000501F5));
    TEST_ASSERT_TRUE(heartbeat_entry_taken(entries, 4, 1, 0x0007FFFF));
    TEST_ASSERT_FALSE(heartbeat_entry_taken(entries, 4, 0, 0x000501F5));
    TEST_ASSERT_FALSE(heartbeat_entry_taken(entries, 4, 1, 0x000401F4));
    TEST_ASSERT_FALSE(heartbeat_entry_taken(entries, 4, 1, 0x000601F4));
    TEST_ASSERT_FALSE(heartbeat_entry_taken(entries, 4, 1, 0x00050000));
    TEST_ASSERT_FALSE(heartbeat_entry_taken(entries, 3, 1, 0x00071388));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_produces_at_its_period);
    RUN_TEST(test_period_does_not_drift);
    RUN_TEST(test_a_late_call_gives_one_frame);
    RUN_TEST(test_no_heartbeat_when_off_or_initialising);
    RUN_TEST(test_consumer_follows_states);
    RUN_TEST(test_consumer_reports_a_loss_once);
    RUN_TEST(test_each_heartbeat_restarts_the_time);
    RUN_TEST(test_consumer_ignores_others);
    RUN_TEST(test_consumer_entry_of_0x1016);
    RUN_TEST(test_a_node_is_monitored_by_one_entry_only);
    return UNITY_END();
}
