/* SPDX-License-Identifier: MIT */
/* The client against our server, and against raw frames. Run by `make unit`; no I/O. */
#include "canopen/sdo_client.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "sdo_talk.h"
#include "unity.h"

#define CLIENT_TIMEOUT_US 50000u

static struct sdo_talk talk;
static struct sdo_client client;
static struct can_msg frame;

void setUp(void)
{
    sdo_talk_init(&talk);
    sdo_client_init(&client, CLIENT_TIMEOUT_US);
}

void tearDown(void)
{
}

/* Carries frames between client and server until both send nothing. */
static void run(int begun)
{
    struct can_msg answer;
    bool to_send = true;

    TEST_ASSERT_EQUAL_INT(0, begun);
    for (int rounds = 0; to_send; rounds++) {
        TEST_ASSERT_LESS_THAN_INT(1000, rounds);
        if (!sdo_server_receive(&talk.server, &frame, &answer)) {
            return;
        }
        to_send = sdo_client_receive(&client, &answer, &frame);
    }
}

/* An answer of the server, as raw bytes. */
static bool hear(const uint8_t data[8])
{
    struct can_msg in;

    cob_frame(&in, COB_SDO_RESPONSE + TALK_NODE, 8);
    memcpy(in.data, data, 8);
    return sdo_client_receive(&client, &in, &frame);
}

static void test_writes_and_reads_numbers(void)
{
    run(sdo_client_write_number(&client, TALK_NODE, 0x2001, 0, (uint64_t)-42, 2, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, client.status);
    TEST_ASSERT_EQUAL_INT16(-42, talk.small.values.with_sign);
    run(sdo_client_read_number(&client, TALK_NODE, 0x2001, 0, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, client.status);
    TEST_ASSERT_EQUAL_UINT32(2, client.size);
    TEST_ASSERT_EQUAL_INT64(-42, sdo_client_signed(&client));
    TEST_ASSERT_EQUAL_UINT64(0xFFD6, sdo_client_unsigned(&client));
}

static void test_wide_numbers_go_segmented(void)
{
    run(sdo_client_write_number(&client, TALK_NODE, 0x2004, 1, UINT64_C(0x123456789ABCDEF0), 8,
                                &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, client.status);
    TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x123456789ABCDEF0), talk.small.values.wide);
    run(sdo_client_read_number(&client, TALK_NODE, 0x2004, 3, &frame));
    TEST_ASSERT_EQUAL_INT64(INT64_MIN + 1, sdo_client_signed(&client));
}

static void test_long_values_of_every_length(void)
{
    uint8_t sent[200];
    uint8_t got[200];

    for (uint32_t i = 0; i < sizeof sent; i++) {
        sent[i] = (uint8_t)(i + 1);
    }
    for (uint32_t size = 1; size <= sizeof sent; size++) {
        run(sdo_client_write(&client, TALK_NODE, 0x2005, 0, sent, size, &frame));
        TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, client.status);
        memset(got, 0, sizeof got);
        run(sdo_client_read(&client, TALK_NODE, 0x2005, 0, got, size, &frame));
        TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, client.status);
        TEST_ASSERT_EQUAL_UINT32(size, client.size);
        TEST_ASSERT_EQUAL_MEMORY(sent, got, size);
    }
}

static void test_reports_why_the_server_refused(void)
{
    run(sdo_client_write_number(&client, TALK_NODE, 0x2000, 0, 9, 1, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_REFUSED, client.status);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, client.abort_code);
    run(sdo_client_read_number(&client, TALK_NODE, 0x7777, 0, &frame));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, client.abort_code);
}

static void test_a_value_that_does_not_fit_is_given_up(void)
{
    uint8_t room[5];

    run(sdo_client_read(&client, TALK_NODE, 0x2006, 0, room, sizeof room, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_FAILED, client.status);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_MEMORY, client.abort_code);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_timeout(void)
{
    sdo_client_read_number(&client, TALK_NODE, 0x2003, 0, &frame);
    TEST_ASSERT_FALSE(sdo_client_process(&client, CLIENT_TIMEOUT_US - 1, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_BUSY, client.status);
    TEST_ASSERT_TRUE(sdo_client_process(&client, 1, &frame));
    TEST_ASSERT_EQUAL_HEX32(COB_SDO_REQUEST + TALK_NODE, frame.id);
    TEST_ASSERT_EQUAL_HEX8(0x80, frame.data[0]);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TIMEOUT, cob_get(frame.data + 4, 4));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_FAILED, client.status);
    TEST_ASSERT_FALSE(sdo_client_process(&client, UINT32_MAX, &frame));
}

static void test_arguments(void)
{
    uint8_t byte = 0;

    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_ARGUMENT,
                          sdo_client_read_number(&client, 0, 0x2003, 0, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_ARGUMENT,
                          sdo_client_read_number(&client, 128, 0x2003, 0, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_ARGUMENT,
                          sdo_client_write(&client, 5, 0x2003, 0, &byte, 0, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_ARGUMENT,
                          sdo_client_write_number(&client, 5, 0x2003, 0, 1, 9, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_IDLE, client.status);
    TEST_ASSERT_EQUAL_INT(0, sdo_client_read_number(&client, 5, 0x2003, 0, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_BUSY,
                          sdo_client_write_number(&client, 5, 0x2003, 0, 1, 4, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_ERR_BUSY,
                          sdo_client_read(&client, 5, 0x2003, 0, &byte, 1, &frame));
}

static void test_ignores_late_and_foreign_frames(void)
{
    const uint8_t about_another[8] = {0x43, 0x04, 0x20, 0x00, 1};
    const uint8_t abort_of_another[8] = {0x80, 0x04, 0x20, 0x00, 0, 0, 4, 5};
    const uint8_t abort_of_0x6000[8] = {0x80, 0x00, 0x60, 0x00, 0, 0, 4, 5};
    const uint8_t abort_of_none[8] = {0x80, 0x00, 0x00, 0x00, 0, 0, 4, 5};
    struct can_msg foreign;

    sdo_client_read_number(&client, TALK_NODE, 0x2003, 0, &frame);
    TEST_ASSERT_FALSE(hear(about_another));
    TEST_ASSERT_FALSE(hear(abort_of_another));
    TEST_ASSERT_FALSE(hear(abort_of_0x6000));
    cob_frame(&foreign, COB_SDO_RESPONSE + TALK_NODE + 1, 8);
    foreign.data[0] = 0x80;
    TEST_ASSERT_FALSE(sdo_client_receive(&client, &foreign, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_BUSY, client.status);
    TEST_ASSERT_FALSE(hear(abort_of_none)); /* of a server that does not know the object */
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_REFUSED, client.status);
}

static void test_wrong_answers_end_the_transfer(void)
{
    const uint8_t download_answer[8] = {0x60, 0x06, 0x20, 0x00};
    const uint8_t upload_answer[8] = {0x41, 0x06, 0x20, 0x00, 12};
    const uint8_t wrong_toggle[8] = {0x10};
    uint8_t buffer[20];

    sdo_client_read(&client, TALK_NODE, 0x2006, 0, buffer, sizeof buffer, &frame);
    TEST_ASSERT_TRUE(hear(download_answer));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_COMMAND, client.abort_code);
    sdo_client_read(&client, TALK_NODE, 0x2006, 0, buffer, sizeof buffer, &frame);
    TEST_ASSERT_TRUE(hear(upload_answer));
    TEST_ASSERT_EQUAL_HEX8(0x60, frame.data[0]);
    TEST_ASSERT_TRUE(hear(wrong_toggle));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOGGLE, client.abort_code);
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_FAILED, client.status);
}

static void test_a_server_that_sends_nothing_for_ever_is_given_up(void)
{
    const uint8_t upload_answer[8] = {0x41, 0x06, 0x20, 0x00, 12};
    uint8_t empty_segment[8] = {0x0E};
    uint8_t buffer[20];

    sdo_client_read(&client, TALK_NODE, 0x2006, 0, buffer, sizeof buffer, &frame);
    TEST_ASSERT_TRUE(hear(upload_answer));
    for (int i = 0; i < 8; i++) {
        TEST_ASSERT_TRUE(hear(empty_segment));
        TEST_ASSERT_EQUAL_INT(SDO_CLIENT_BUSY, client.status);
        empty_segment[0] ^= 0x10;
    }
    TEST_ASSERT_TRUE(hear(empty_segment));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_FAILED, client.status);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_DATA, client.abort_code);
    TEST_ASSERT_EQUAL_HEX8(0x80, frame.data[0]);
}

static void test_cancel(void)
{
    TEST_ASSERT_FALSE(sdo_client_cancel(&client, SDO_ABORT_GENERAL, &frame));
    sdo_client_read_number(&client, TALK_NODE, 0x2003, 0, &frame);
    TEST_ASSERT_TRUE(sdo_client_cancel(&client, SDO_ABORT_GENERAL, &frame));
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_FAILED, client.status);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_writes_and_reads_numbers);
    RUN_TEST(test_wide_numbers_go_segmented);
    RUN_TEST(test_long_values_of_every_length);
    RUN_TEST(test_reports_why_the_server_refused);
    RUN_TEST(test_a_value_that_does_not_fit_is_given_up);
    RUN_TEST(test_timeout);
    RUN_TEST(test_arguments);
    RUN_TEST(test_ignores_late_and_foreign_frames);
    RUN_TEST(test_wrong_answers_end_the_transfer);
    RUN_TEST(test_a_server_that_sends_nothing_for_ever_is_given_up);
    RUN_TEST(test_cancel);
    return UNITY_END();
}
