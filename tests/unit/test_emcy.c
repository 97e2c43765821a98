/* SPDX-License-Identifier: MIT */
/* Tests of canopen/emcy.h: emergency messages, error register 0x1001 and history 0x1003. Run by `make unit`; no I/O. */
#include "canopen/emcy.h"

#include "canopen/cob.h"
#include "unity.h"

#define HISTORY 3u

static struct emcy_producer producer;
static uint8_t error_register, count;
static uint32_t history[HISTORY];
static struct can_msg out;

void setUp(void)
{
    error_register = 0xFF;
    count = 9;
    emcy_producer_init(&producer, 6, &error_register, history, &count, HISTORY);
}

void tearDown(void)
{
}

static void test_begins_without_errors(void)
{
    TEST_ASSERT_EQUAL_HEX8(0, error_register);
    TEST_ASSERT_EQUAL_UINT8(0, count);
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
}

static void test_message_on_the_wire(void)
{
    const uint8_t detail[EMCY_DETAIL_SIZE] = {1, 2, 3, 4, 5};
    const uint8_t expected[8] = {0x11, 0x86, 0x21, 1, 2, 3, 4, 5};

    emcy_producer_raise(&producer, EMCY_FOLLOWING_ERROR, EMCY_REGISTER_PROFILE, detail);
    TEST_ASSERT_EQUAL_HEX8(0x21, error_register);
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_HEX32(0x086, out.id);
    TEST_ASSERT_EQUAL_UINT8(8, out.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, out.data, 8);
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
}

static void test_history_has_the_newest_first(void)
{
    const uint8_t detail[EMCY_DETAIL_SIZE] = {0xCD, 0xAB};

    emcy_producer_raise(&producer, 0x8110, EMCY_REGISTER_COMMUNICATION, detail);
    TEST_ASSERT_EQUAL_UINT8(1, count);
    TEST_ASSERT_EQUAL_HEX32(0xABCD8110, history[0]);
    emcy_producer_raise(&producer, 0x8120, EMCY_REGISTER_COMMUNICATION, NULL);
    emcy_producer_raise(&producer, 0x8130, EMCY_REGISTER_COMMUNICATION, NULL);
    emcy_producer_raise(&producer, 0x8140, EMCY_REGISTER_COMMUNICATION, NULL);
    TEST_ASSERT_EQUAL_UINT8(HISTORY, count);
    TEST_ASSERT_EQUAL_HEX32(0x8140, history[0]);
    TEST_ASSERT_EQUAL_HEX32(0x8130, history[1]);
    TEST_ASSERT_EQUAL_HEX32(0x8120, history[2]);
    emcy_producer_forget(&producer);
    TEST_ASSERT_EQUAL_UINT8(0, count);
    TEST_ASSERT_EQUAL_HEX32(0, history[0]);
}

static void test_messages_keep_their_order(void)
{
    struct emcy got;

    for (uint16_t code = 1; code <= 3; code++) {
        emcy_producer_raise(&producer, code, 0, NULL);
    }
    for (uint16_t code = 1; code <= 3; code++) {
        TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
        TEST_ASSERT_EQUAL_UINT8(6, emcy_decode(&out, &got));
        TEST_ASSERT_EQUAL_UINT16(code, got.code);
    }
}

static void test_a_full_queue_keeps_the_newest(void)
{
    int frames = 0;

    for (uint16_t code = 1; code <= 10; code++) {
        emcy_producer_raise(&producer, code, 0, NULL);
    }
    TEST_ASSERT_EQUAL_HEX32(10, history[0]);
    while (emcy_producer_process(&producer, &out)) {
        frames++;
    }
    TEST_ASSERT_EQUAL_INT(4, frames);
    TEST_ASSERT_EQUAL_UINT8(10, out.data[0]);
}

static void test_a_flood_of_one_code_does_not_push_out_another(void)
{
    emcy_producer_raise(&producer, 1, 0, NULL);
    emcy_producer_raise(&producer, 2, 0, NULL);
    emcy_producer_raise(&producer, 2, 0, NULL);
    emcy_producer_raise(&producer, 3, 0, NULL);
    for (int i = 0; i < 5; i++) {
        emcy_producer_raise(&producer, 2, 0, NULL);
    }
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_UINT8(1, out.data[0]);
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_UINT8(3, out.data[0]);
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_UINT8(2, out.data[0]);
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_UINT8(2, out.data[0]);
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
}

/* Also where that is the first of the queue, and another of its code is after it. */
static void test_of_a_repeated_code_the_oldest_goes(void)
{
    const uint8_t raised[] = {2, 3, 2, 1, 2};
    const uint8_t sent[] = {3, 2, 1, 2};

    for (size_t i = 0; i < sizeof raised; i++) {
        emcy_producer_raise(&producer, raised[i], 0, NULL);
    }
    for (size_t i = 0; i < sizeof sent; i++) {
        TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
        TEST_ASSERT_EQUAL_UINT8(sent[i], out.data[0]);
    }
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
}

static void test_no_error_when_the_last_one_is_gone(void)
{
    struct emcy got;

    emcy_producer_raise(&producer, 0x8130, EMCY_REGISTER_COMMUNICATION, NULL);
    emcy_producer_raise(&producer, 0x2310, EMCY_REGISTER_CURRENT, NULL);
    emcy_producer_process(&producer, &out);
    emcy_producer_process(&producer, &out);
    emcy_producer_clear(&producer, EMCY_REGISTER_CURRENT);
    TEST_ASSERT_EQUAL_HEX8(EMCY_REGISTER_COMMUNICATION | EMCY_REGISTER_GENERIC, error_register);
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
    emcy_producer_clear(&producer, EMCY_REGISTER_COMMUNICATION);
    TEST_ASSERT_EQUAL_HEX8(0, error_register);
    TEST_ASSERT_TRUE(emcy_producer_process(&producer, &out));
    emcy_decode(&out, &got);
    TEST_ASSERT_EQUAL_HEX16(0, got.code);
    TEST_ASSERT_EQUAL_HEX8(0, got.error_register);
    emcy_producer_clear(&producer, 0xFF);
    TEST_ASSERT_FALSE(emcy_producer_process(&producer, &out));
    TEST_ASSERT_EQUAL_UINT8(2, count);
}

static void test_decode_ignores_other_frames(void)
{
    struct emcy got;

    cob_frame(&out, 0x080, 8); /* SYNC */
    TEST_ASSERT_EQUAL_UINT8(0, emcy_decode(&out, &got));
    cob_frame(&out, 0x100, 8);
    TEST_ASSERT_EQUAL_UINT8(0, emcy_decode(&out, &got));
    cob_frame(&out, 0x086, 7);
    TEST_ASSERT_EQUAL_UINT8(0, emcy_decode(&out, &got));
    cob_frame(&out, 0x0FF, 8);
    TEST_ASSERT_EQUAL_UINT8(127, emcy_decode(&out, &got));
}

static void test_texts(void)
{
    TEST_ASSERT_EQUAL_STRING("no error", emcy_text(0));
    TEST_ASSERT_EQUAL_STRING("following error", emcy_text(EMCY_FOLLOWING_ERROR));
    TEST_ASSERT_EQUAL_STRING("voltage", emcy_text(0x3110));
    TEST_ASSERT_EQUAL_STRING("monitoring", emcy_text(0x8FFF));
    for (uint32_t code = 0; code <= UINT16_MAX; code++) {
        TEST_ASSERT_NOT_NULL(emcy_text((uint16_t)code));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_begins_without_errors);
    RUN_TEST(test_message_on_the_wire);
    RUN_TEST(test_history_has_the_newest_first);
    RUN_TEST(test_messages_keep_their_order);
    RUN_TEST(test_a_full_queue_keeps_the_newest);
    RUN_TEST(test_a_flood_of_one_code_does_not_push_out_another);
    RUN_TEST(test_of_a_repeated_code_the_oldest_goes);
    RUN_TEST(test_no_error_when_the_last_one_is_gone);
    RUN_TEST(test_decode_ignores_other_frames);
    RUN_TEST(test_texts);
    return UNITY_END();
}
