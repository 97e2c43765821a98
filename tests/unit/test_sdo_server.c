/* SPDX-License-Identifier: MIT */
/* Expedited and segmented transfers. Frames are written as CiA 301 draws them. Run by `make unit`; no I/O. */
#include "canopen/sdo_server.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "sdo_talk.h"
#include "unity.h"

static struct sdo_talk talk;

void setUp(void)
{
    sdo_talk_init(&talk);
}

void tearDown(void)
{
}

static void expect_abort(uint32_t code)
{
    TEST_ASSERT_EQUAL_HEX8(0x80, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_HEX32(code, sdo_talk_abort_code(&talk));
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    TEST_ASSERT_FALSE(talk.small.open);
}

static void expect_frame(const uint8_t expected[8])
{
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, talk.answer.data, 8);
}

static void test_expedited_upload(void)
{
    const uint8_t expected[8] = {0x43, 0x00, 0x10, 0x00, 0x78, 0x56, 0x34, 0x12};
    const uint8_t two_bytes[8] = {0x4B, 0x01, 0x20, 0x00, 0xF9, 0xFF, 0x00, 0x00};

    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x40, 0x1000, 0, 0));
    expect_frame(expected);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x40, 0x2001, 0, 0));
    expect_frame(two_bytes);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_expedited_download(void)
{
    const uint8_t expected[8] = {0x60, 0x03, 0x20, 0x00};

    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x23, 0x2003, 0, 0xCAFEF00D));
    expect_frame(expected);
    TEST_ASSERT_EQUAL_HEX32(0xCAFEF00D, talk.small.values.word);
    sdo_talk_ask(&talk, 0x2F, 0x2000, 0, 4);
    TEST_ASSERT_EQUAL_UINT8(4, talk.small.values.limited);
}

static void test_expedited_download_without_size_takes_the_dictionarys(void)
{
    sdo_talk_ask(&talk, 0x22, 0x2001, 0, 0x00000032);
    TEST_ASSERT_EQUAL_INT16(50, talk.small.values.with_sign);
    TEST_ASSERT_EQUAL_HEX8(0x60, talk.answer.data[0]);
}

static void test_abort_codes_of_initiates(void)
{
    struct {
        uint32_t command;
        uint16_t index;
        uint16_t sub;
        uint32_t data;
        uint32_t code;
    } cases[] = {
        {0x40, 0x3000, 0, 0, SDO_ABORT_NO_OBJECT},
        {0x40, 0x2004, 9, 0, SDO_ABORT_NO_SUB},
        {0x40, 0x2002, 0, 0, SDO_ABORT_WRITE_ONLY},
        {0x23, 0x3000, 0, 0, SDO_ABORT_NO_OBJECT},
        {0x23, 0x2004, 9, 0, SDO_ABORT_NO_SUB},
        {0x23, 0x1000, 0, 0, SDO_ABORT_READ_ONLY},
        {0x23, 0x2000, 0, 1, SDO_ABORT_TOO_LONG},
        {0x2F, 0x2003, 0, 1, SDO_ABORT_TOO_SHORT},
        {0x2F, 0x2000, 0, 9, SDO_ABORT_TOO_HIGH},
        {0x2F, 0x2000, 0, 0, SDO_ABORT_TOO_LOW},
        {0x2F, 0x2007, 0, 2, SDO_ABORT_VALUE},
        {0x21, 0x2003, 0, 5, SDO_ABORT_TOO_LONG},
        {0x21, 0x2004, 1, 7, SDO_ABORT_TOO_SHORT},
        {0x21, 0x2006, 0, 21, SDO_ABORT_TOO_LONG},
        {0x21, 0x2005, 0, SMALL_DOMAIN_MAX + 1, SDO_ABORT_MEMORY},
        {0x21, 0x1000, 0, 4, SDO_ABORT_READ_ONLY},
    };

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        TEST_ASSERT_TRUE(sdo_talk_ask(&talk, (uint8_t)cases[i].command, cases[i].index,
                                      (uint8_t)cases[i].sub, cases[i].data));
        expect_abort(cases[i].code);
        TEST_ASSERT_EQUAL_HEX32(cases[i].index, cob_get(talk.answer.data + 1, 2));
        TEST_ASSERT_EQUAL_HEX16(cases[i].sub, talk.answer.data[3]);
    }
    TEST_ASSERT_EQUAL_INT(0, talk.small.written);
}

static void test_hooks_can_refuse(void)
{
    talk.small.veto = SDO_ABORT_STATE;
    sdo_talk_ask(&talk, 0x23, 0x2003, 0, 1);
    expect_abort(SDO_ABORT_STATE);
    talk.small.read_refusal = SDO_ABORT_HARDWARE;
    sdo_talk_ask(&talk, 0x40, 0x2003, 0, 0);
    expect_abort(SDO_ABORT_HARDWARE);
    talk.small.begin_refusal = SDO_ABORT_STATE;
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 10);
    expect_abort(SDO_ABORT_STATE);
    TEST_ASSERT_EQUAL_INT(0, talk.small.aborted);
}

static void test_a_domain_without_hooks_is_out_of_reach(void)
{
    od_init(&talk.small.od, talk.small.od.table, &talk.small.values, NULL, NULL);
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 10);
    expect_abort(SDO_ABORT_ACCESS);
    sdo_talk_ask(&talk, 0x40, 0x2005, 0, 0);
    expect_abort(SDO_ABORT_ACCESS);
    sdo_talk_ask(&talk, 0x23, 0x2003, 0, 7);
    TEST_ASSERT_EQUAL_UINT32(7, talk.small.values.word);
}

static void test_unknown_commands(void)
{
    static const uint8_t commands[] = {0x00, 0x10, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0, 0xFF};

    for (size_t i = 0; i < sizeof commands; i++) {
        TEST_ASSERT_TRUE(sdo_talk_ask(&talk, commands[i], 0x2003, 0, 0));
        expect_abort(SDO_ABORT_COMMAND);
    }
}

/* A segment that belongs to no transfer is refused without naming the object of the one before. */
static void test_a_stray_segment_names_no_object(void)
{
    const uint8_t expected[8] = {0x80, 0, 0, 0, 0x01, 0x00, 0x04, 0x05};

    sdo_talk_ask(&talk, 0x40, 0x2004, 3, 0);
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    sdo_talk_ask(&talk, 0x70, 0, 0, 0);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    expect_frame(expected);
}

static void test_ignores_what_is_not_for_it(void)
{
    struct can_msg in;

    cob_frame(&in, COB_SDO_REQUEST + TALK_NODE + 1, 8);
    in.data[0] = 0x40;
    TEST_ASSERT_FALSE(sdo_server_receive(&talk.server, &in, &talk.answer));
    cob_frame(&in, COB_SDO_REQUEST + TALK_NODE, 7);
    in.data[0] = 0x40;
    TEST_ASSERT_FALSE(sdo_server_receive(&talk.server, &in, &talk.answer));
    TEST_ASSERT_FALSE(sdo_talk_ask(&talk, 0x80, 0x2003, 0, SDO_ABORT_GENERAL));
}

static void test_segmented_upload_of_a_string(void)
{
    const uint8_t initiate[8] = {0x41, 0x06, 0x20, 0x00, 12};

    sdo_talk_ask(&talk, 0x40, 0x2006, 0, 0);
    expect_frame(initiate);
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    TEST_ASSERT_EQUAL_HEX8(0x00, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_MEMORY("hello, ", talk.answer.data + 1, 7);
    sdo_talk_ask(&talk, 0x70, 0, 0, 0);
    TEST_ASSERT_EQUAL_HEX8(0x15, talk.answer.data[0]); /* toggle, 2 unused, last */
    TEST_ASSERT_EQUAL_MEMORY("world\0\0", talk.answer.data + 1, 7);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_segmented_upload_of_an_empty_string(void)
{
    const uint8_t initiate[8] = {0x41, 0x06, 0x20, 0x00, 0};

    memset(talk.small.values.text, 0, sizeof talk.small.values.text);
    sdo_talk_ask(&talk, 0x40, 0x2006, 0, 0);
    expect_frame(initiate);
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    TEST_ASSERT_EQUAL_HEX8(0x0F, talk.answer.data[0]);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_segmented_upload_of_a_wide_number(void)
{
    uint64_t value;

    sdo_talk_ask(&talk, 0x40, 0x2004, 3, 0);
    TEST_ASSERT_EQUAL_HEX8(0x41, talk.answer.data[0]);
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    value = cob_get(talk.answer.data + 1, 7);
    sdo_talk_ask(&talk, 0x70, 0, 0, 0);
    value |= (uint64_t)talk.answer.data[1] << 56;
    TEST_ASSERT_EQUAL_INT64(INT64_MIN + 1, cob_signed(value, 8));
    TEST_ASSERT_EQUAL_HEX8(0x1D, talk.answer.data[0]);
}

static void download_string(const char *text, uint32_t announced)
{
    uint32_t size = (uint32_t)strlen(text);
    uint8_t toggle = 0;

    sdo_talk_ask(&talk, announced != 0 ? 0x21 : 0x20, 0x2006, 0, announced);
    for (uint32_t at = 0; at < size && talk.answer.data[0] != 0x80; at += 7) {
        uint32_t now = size - at < 7 ? size - at : 7;
        uint32_t first = toggle | (7 - now) << 1 | (at + now == size ? 1u : 0u);
        sdo_talk_segment(&talk, (uint8_t)first, (const uint8_t *)text + at, now);
        toggle ^= 0x10;
    }
}

static void test_segmented_download_of_strings(void)
{
    download_string("seven..", 7);
    TEST_ASSERT_EQUAL_STRING("seven..", talk.small.values.text);
    download_string("x", 0);
    TEST_ASSERT_EQUAL_STRING("x", talk.small.values.text);
    download_string("exactly twenty bytes", 20);
    TEST_ASSERT_EQUAL_STRING("exactly twenty bytes", talk.small.values.text);
    TEST_ASSERT_EQUAL_HEX8(0x20, talk.answer.data[0]); /* third segment: toggle 0 again */
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    TEST_ASSERT_EQUAL_INT(3, talk.small.written);
}

static void test_segmented_download_of_wrong_length(void)
{
    download_string("thirteen chars", 10);
    expect_abort(SDO_ABORT_TOO_LONG);
    download_string("short", 10);
    expect_abort(SDO_ABORT_TOO_SHORT);
    download_string("much more than twenty bytes", 0);
    expect_abort(SDO_ABORT_TOO_LONG);
    TEST_ASSERT_EQUAL_STRING("hello, world", talk.small.values.text);
}

static void test_toggle_errors(void)
{
    const uint8_t data[7] = {0};

    sdo_talk_ask(&talk, 0x21, 0x2006, 0, 14);
    sdo_talk_segment(&talk, 0x10, data, 7);
    expect_abort(SDO_ABORT_TOGGLE);
    sdo_talk_ask(&talk, 0x21, 0x2006, 0, 14);
    sdo_talk_segment(&talk, 0x00, data, 7);
    sdo_talk_segment(&talk, 0x00, data, 7);
    expect_abort(SDO_ABORT_TOGGLE);
    sdo_talk_ask(&talk, 0x40, 0x2006, 0, 0);
    sdo_talk_ask(&talk, 0x70, 0, 0, 0);
    expect_abort(SDO_ABORT_TOGGLE);
    TEST_ASSERT_EQUAL_INT(0, talk.small.written);
}

static void test_wrong_kind_of_segment(void)
{
    sdo_talk_ask(&talk, 0x21, 0x2006, 0, 14);
    sdo_talk_ask(&talk, 0x60, 0, 0, 0);
    expect_abort(SDO_ABORT_COMMAND);
    sdo_talk_ask(&talk, 0x40, 0x2006, 0, 0);
    sdo_talk_ask(&talk, 0x00, 0, 0, 0);
    expect_abort(SDO_ABORT_COMMAND);
}

static void test_segmented_download_of_a_domain(void)
{
    const uint8_t data[7] = {1, 2, 3, 4, 5, 6, 7};

    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 10);
    TEST_ASSERT_EQUAL_UINT32(10, talk.small.announced);
    sdo_talk_segment(&talk, 0x00, data, 7);
    sdo_talk_segment(&talk, 0x10 | 4 << 1 | 1, data, 3);
    TEST_ASSERT_EQUAL_HEX8(0x30, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_INT(1, talk.small.ended);
    TEST_ASSERT_EQUAL_INT(0, talk.small.aborted);
    TEST_ASSERT_EQUAL_UINT32(10, talk.small.domain_size);
    TEST_ASSERT_EQUAL_UINT8(3, talk.small.domain[9]);
}

static void test_domain_refused_at_the_end(void)
{
    const uint8_t data[7] = {0};

    talk.small.end_refusal = SDO_ABORT_VALUE;
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 7);
    sdo_talk_segment(&talk, 0x01, data, 7);
    expect_abort(SDO_ABORT_VALUE);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_EQUAL_INT(0, talk.small.ended);
}

static void test_an_abort_midway_is_reported_to_the_domain(void)
{
    const uint8_t data[7] = {0};

    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    sdo_talk_segment(&talk, 0x00, data, 7);
    TEST_ASSERT_FALSE(sdo_talk_ask(&talk, 0x80, 0x2005, 0, SDO_ABORT_GENERAL));
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    sdo_talk_segment(&talk, 0x10, data, 7);
    expect_abort(SDO_ABORT_COMMAND);
}

/* A request during a transfer is refused, with the object that it names; the transfer goes on. */
static void test_a_second_client_is_refused(void)
{
    static const uint8_t asks[] = {0x20, 0x21, 0x23, 0x2F, 0x40, 0xA0, 0xA4, 0xC0, 0xC6};
    const uint8_t data[7] = {0};

    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    sdo_talk_segment(&talk, 0x00, data, 7);
    for (unsigned i = 0; i < sizeof asks; ++i) {
        TEST_ASSERT_TRUE(sdo_talk_ask(&talk, asks[i], 0x2003, 0, 1));
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
        TEST_ASSERT_TRUE(sdo_talk_busy(&talk));
        TEST_ASSERT_EQUAL_HEX16(0x2003, cob_get(talk.answer.data + 1, 2));
        TEST_ASSERT_EQUAL_UINT8(0, talk.answer.data[3]);
    }
    TEST_ASSERT_FALSE(sdo_talk_ask(&talk, 0x80, 0x2003, 0, SDO_ABORT_TIMEOUT));
    TEST_ASSERT_EQUAL_INT(0, talk.small.aborted);
    sdo_talk_segment(&talk, 0x11, data, 7);
    TEST_ASSERT_EQUAL_HEX8(0x30, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT32(14, talk.small.domain_size);
    TEST_ASSERT_EQUAL_INT(1, talk.small.ended);
}

/* The transfer goes on in all states; `first`, sub and value of the write are the one thing that lets it through. */
static void test_an_urgent_write_is_done_beside_a_transfer(void)
{
    const uint8_t expected[8] = {0x60, 0x00, 0x20, 0x00};
    const uint8_t data[7] = {0};
    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    sdo_talk_segment(&talk, 0x00, data, 7);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 0, SMALL_URGENT));
    expect_frame(expected);
    TEST_ASSERT_EQUAL_UINT8(SMALL_URGENT, talk.small.values.limited);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 0, SMALL_URGENT - 1u));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2B, 0x2000, 0, SMALL_URGENT));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 1, SMALL_URGENT));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
    talk.small.veto = SDO_ABORT_STATE;
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 0, SMALL_URGENT));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, sdo_talk_abort_code(&talk));
    talk.small.veto = SDO_OK;
    sdo_talk_segment(&talk, 0x11, data, 7);
    TEST_ASSERT_EQUAL_HEX8(0x30, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT32(14, talk.small.domain_size);
    TEST_ASSERT_EQUAL_INT(1, talk.small.ended);
}

/* A transfer without its client still ends by its timeout. */
static void test_an_urgent_write_does_not_keep_a_transfer_alive(void)
{
    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 0, SMALL_URGENT));
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, 1, &talk.answer));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TIMEOUT, sdo_talk_abort_code(&talk));
}

/* A second client's attempts do not keep a transfer alive whose client is gone. */
static void test_a_transfer_that_is_left_times_out_all_the_same(void)
{
    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    sdo_talk_segment(&talk, 0x00, (const uint8_t[7]){0}, 7);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    sdo_talk_ask(&talk, 0x40, 0x2003, 0, 0);
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, 1, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
}

static void test_a_lost_answer_to_the_first_request_is_requested_again(void)
{
    const uint8_t data[7] = {0};

    sdo_talk_ask(&talk, 0x20, 0x2005, 0, 0);
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 7);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    sdo_talk_segment(&talk, 0x01, data, 7);
    TEST_ASSERT_EQUAL_HEX8(0x20, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT32(7, talk.small.domain_size);
    TEST_ASSERT_EQUAL_INT(1, talk.small.ended);
}

static void test_timeout(void)
{
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 10);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, 1, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, UINT32_MAX, &talk.answer));
}

static void test_each_frame_restarts_the_timeout(void)
{
    const uint8_t data[7] = {0};

    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 21);
    sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer);
    sdo_talk_segment(&talk, 0x00, data, 7);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_talk_busy(&talk));
}

static void test_reset_sends_nothing(void)
{
    sdo_talk_ask(&talk, 0x21, 0x2005, 0, 21);
    sdo_server_reset(&talk.server);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_abort_texts(void)
{
    TEST_ASSERT_EQUAL_STRING("object does not exist", sdo_abort_text(SDO_ABORT_NO_OBJECT));
    TEST_ASSERT_EQUAL_STRING("unknown abort code", sdo_abort_text(0x12345678));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_expedited_upload);
    RUN_TEST(test_expedited_download);
    RUN_TEST(test_expedited_download_without_size_takes_the_dictionarys);
    RUN_TEST(test_abort_codes_of_initiates);
    RUN_TEST(test_hooks_can_refuse);
    RUN_TEST(test_a_domain_without_hooks_is_out_of_reach);
    RUN_TEST(test_unknown_commands);
    RUN_TEST(test_a_stray_segment_names_no_object);
    RUN_TEST(test_ignores_what_is_not_for_it);
    RUN_TEST(test_segmented_upload_of_a_string);
    RUN_TEST(test_segmented_upload_of_an_empty_string);
    RUN_TEST(test_segmented_upload_of_a_wide_number);
    RUN_TEST(test_segmented_download_of_strings);
    RUN_TEST(test_segmented_download_of_wrong_length);
    RUN_TEST(test_toggle_errors);
    RUN_TEST(test_wrong_kind_of_segment);
    RUN_TEST(test_segmented_download_of_a_domain);
    RUN_TEST(test_domain_refused_at_the_end);
    RUN_TEST(test_an_abort_midway_is_reported_to_the_domain);
    RUN_TEST(test_a_second_client_is_refused);
    RUN_TEST(test_an_urgent_write_is_done_beside_a_transfer);
    RUN_TEST(test_an_urgent_write_does_not_keep_a_transfer_alive);
    RUN_TEST(test_a_transfer_that_is_left_times_out_all_the_same);
    RUN_TEST(test_a_lost_answer_to_the_first_request_is_requested_again);
    RUN_TEST(test_timeout);
    RUN_TEST(test_each_frame_restarts_the_timeout);
    RUN_TEST(test_reset_sends_nothing);
    RUN_TEST(test_abort_texts);
    return UNITY_END();
}
