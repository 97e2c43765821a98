/* SPDX-License-Identifier: MIT */
/* Tests of canopen/sync.h: SYNC with counter, producer and consumer. Run by `make unit`; no I/O. */
#include "canopen/sync.h"

#include "canopen/cob.h"
#include "unity.h"

static struct sync_producer producer;
static struct sync_consumer consumer;

void setUp(void)
{
    sync_producer_init(&producer, 240);
    sync_consumer_init(&consumer, 240);
}

void tearDown(void)
{
}

static int hear(uint8_t counter)
{
    struct can_msg in;

    cob_frame(&in, COB_SYNC, 1);
    in.data[0] = counter;
    return sync_consumer_receive(&consumer, &in);
}

static void test_counts_from_1_to_240_and_again(void)
{
    for (uint32_t i = 0; i < 1000; i++) {
        const struct can_msg *out = sync_producer_next(&producer);
        TEST_ASSERT_EQUAL_HEX32(0x80, out->id);
        TEST_ASSERT_EQUAL_UINT8(1, out->len);
        TEST_ASSERT_EQUAL_UINT8(i % 240 + 1, out->data[0]);
        TEST_ASSERT_EQUAL_INT(1, sync_consumer_receive(&consumer, out));
    }
}

static void test_without_counter(void)
{
    sync_producer_init(&producer, 0);
    sync_consumer_init(&consumer, 0);
    const struct can_msg *out = sync_producer_next(&producer);
    TEST_ASSERT_EQUAL_UINT8(0, out->len);
    TEST_ASSERT_EQUAL_UINT8(0, out->data[0]);
    TEST_ASSERT_EQUAL_INT(1, sync_consumer_receive(&consumer, out));
    TEST_ASSERT_EQUAL_INT(1, sync_consumer_receive(&consumer, out));
    TEST_ASSERT_EQUAL_INT(SYNC_ERR_LENGTH, hear(1));
}

static void test_counts_lost_periods(void)
{
    TEST_ASSERT_EQUAL_INT(1, hear(17));
    TEST_ASSERT_EQUAL_INT(3, hear(20));
    TEST_ASSERT_EQUAL_INT(219, hear(239));
    TEST_ASSERT_EQUAL_INT(2, hear(1));
    TEST_ASSERT_EQUAL_INT(0, hear(1));
    TEST_ASSERT_EQUAL_INT(239, hear(240));
}

static void test_every_difference(void)
{
    for (int from = 1; from <= 240; from++) {
        for (int step = 0; step < 240; step++) {
            sync_consumer_init(&consumer, 240);
            hear((uint8_t)from);
            TEST_ASSERT_EQUAL_INT(step, hear((uint8_t)((from - 1 + step) % 240 + 1)));
        }
    }
}

static void test_refuses_wrong_frames_and_keeps_its_count(void)
{
    struct can_msg in;

    hear(5);
    TEST_ASSERT_EQUAL_INT(SYNC_ERR_COUNTER, hear(0));
    TEST_ASSERT_EQUAL_INT(SYNC_ERR_COUNTER, hear(241));
    cob_frame(&in, COB_SYNC, 0);
    TEST_ASSERT_EQUAL_INT(SYNC_ERR_LENGTH, sync_consumer_receive(&consumer, &in));
    cob_frame(&in, COB_SYNC + 1, 1);
    TEST_ASSERT_EQUAL_INT(SYNC_NONE, sync_consumer_receive(&consumer, &in));
    TEST_ASSERT_EQUAL_INT(1, hear(6));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_counts_from_1_to_240_and_again);
    RUN_TEST(test_without_counter);
    RUN_TEST(test_counts_lost_periods);
    RUN_TEST(test_every_difference);
    RUN_TEST(test_refuses_wrong_frames_and_keeps_its_count);
    return UNITY_END();
}
