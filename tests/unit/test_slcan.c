/* SPDX-License-Identifier: MIT */
/* Tests of can/slcan.h: CAN frames as lines of text, as LAWICEL's adapters and their many descendants have them. Run
 * by `make unit`; no I/O. */
#include "can/slcan.h"

#include <string.h>

#include "unity.h"

static struct slcan_decoder decoder;
static struct can_msg frame;

void setUp(void)
{
    memset(&decoder, 0, sizeof decoder);
    memset(&frame, 0xEE, sizeof frame);
}

void tearDown(void)
{
}

/* How many frames the text holds; the last one is in `frame`. */
static int decode(const char *text)
{
    int count = 0;
    for (; *text != '\0'; ++text) {
        count += slcan_decode(&decoder, *text, &frame) ? 1 : 0;
    }
    return count;
}

static void check_line(const struct can_msg *message, const char *wanted)
{
    char line[SLCAN_LINE_MAX + 1u] = {0};
    const uint32_t length = slcan_encode(message, line);
    TEST_ASSERT_EQUAL_STRING(wanted, line);
    TEST_ASSERT_EQUAL_UINT32(strlen(wanted), length);
}

static void test_frames_become_lines(void)
{
    check_line(&(struct can_msg){.id = 0x80, .len = 1, .data = {0x2A}}, "t08012A\r");
    check_line(&(struct can_msg){.id = 0, .len = 0}, "t0000\r");
    check_line(
        &(struct can_msg){.id = 0x7FF, .len = 8, .data = {1, 2, 3, 4, 0xAB, 0xCD, 0xEF, 0xFF}},
        "t7FF801020304ABCDEFFF\r");
}

static void test_lines_become_frames(void)
{
    TEST_ASSERT_EQUAL(1, decode("t2026010F112233a4\r"));
    TEST_ASSERT_EQUAL_HEX32(0x202, frame.id);
    TEST_ASSERT_EQUAL_UINT8(6, frame.len);
    const uint8_t data[CAN_DATA_MAX] = {0x01, 0x0F, 0x11, 0x22, 0x33, 0xA4, 0, 0};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, frame.data, CAN_DATA_MAX);
    TEST_ASSERT_EQUAL(2, decode("t0000\rt0801FF\r"));
}

static void test_every_frame_comes_back(void)
{
    uint32_t state = 1;
    for (uint32_t i = 0; i < 5000u; ++i) {
        struct can_msg sent = {.id = i % 2048u, .len = (uint8_t)(i % 9u)};
        for (uint8_t k = 0; k < sent.len; ++k) {
            state = state * 1664525u + 1013904223u;
            sent.data[k] = (uint8_t)(state >> 24);
        }
        char line[SLCAN_LINE_MAX + 1u] = {0};
        (void)slcan_encode(&sent, line);
        TEST_ASSERT_EQUAL(1, decode(line));
        TEST_ASSERT_EQUAL_MEMORY(sent.data, frame.data, CAN_DATA_MAX);
        TEST_ASSERT_EQUAL_UINT32(sent.id, frame.id);
        TEST_ASSERT_EQUAL_UINT8(sent.len, frame.len);
    }
    TEST_ASSERT_EQUAL_UINT32(0, decoder.refused);
}

static void test_a_line_that_closes_is_noted(void)
{
    TEST_ASSERT_EQUAL(0, decode("\rO\rCC\rC1\rt0C\rC\a"));
    TEST_ASSERT_FALSE(decoder.closed);
    TEST_ASSERT_EQUAL(1, decode("t0000\rC\r"));
    TEST_ASSERT_TRUE(decoder.closed);
}

static void test_a_time_stamp_is_allowed(void)
{
    TEST_ASSERT_EQUAL(1, decode("t0801FF12AB\r"));
    TEST_ASSERT_EQUAL_UINT8(0xFF, frame.data[0]);
    TEST_ASSERT_EQUAL(1, decode("t7FF801020304ABCDEFFF0001\r"));
}

static void test_what_is_no_frame_is_passed_over(void)
{
    TEST_ASSERT_EQUAL(0, decode("\r\r\aS8\rO\rC\rz\rZ\rT000000800\rr0808\r"));
    TEST_ASSERT_EQUAL_UINT32(0, decoder.refused);
    TEST_ASSERT_EQUAL(1, decode("t0000\r"));
}

static void test_what_only_has_the_form_of_a_frame_is_refused(void)
{
    static const char *const lines[] = {
        "t\r",        "t080\r",  "t0801\r", "t0801F\r",     "t0801FFF\r",     "t0801G0\r",
        "t8000\r",    "t0009\r", "t08g0\r", "t0801FF123\r", "t0801FF12345\r", "t0801FF\a",
        "t0801 FF\r", "t000/\r", "t000:\r", "t000`\r",      "t0002FF0\r",
    };
    const uint32_t count = (uint32_t)(sizeof lines / sizeof lines[0]);
    for (uint32_t i = 0; i < count; ++i) {
        TEST_ASSERT_EQUAL_MESSAGE(0, decode(lines[i]), lines[i]);
    }
    TEST_ASSERT_EQUAL_UINT32(count, decoder.refused);
}

static void test_a_line_without_end_does_no_harm(void)
{
    for (int i = 0; i < 100000; ++i) {
        TEST_ASSERT_FALSE(slcan_decode(&decoder, 't', &frame));
    }
    TEST_ASSERT_EQUAL(0, decode("\r"));
    TEST_ASSERT_EQUAL(1, decode("t0801FF\r"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_become_lines);
    RUN_TEST(test_lines_become_frames);
    RUN_TEST(test_every_frame_comes_back);
    RUN_TEST(test_a_line_that_closes_is_noted);
    RUN_TEST(test_a_time_stamp_is_allowed);
    RUN_TEST(test_what_is_no_frame_is_passed_over);
    RUN_TEST(test_what_only_has_the_form_of_a_frame_is_refused);
    RUN_TEST(test_a_line_without_end_does_no_harm);
    return UNITY_END();
}
