/* SPDX-License-Identifier: MIT */
/* Tests of port/mps2/command_line.h: the words that the emulator hands on, in place of a board's straps and
 * switches. Run by `make unit`; no I/O. */
#include "port/mps2/command_line.h"

#include <stdio.h>

#include "unity.h"

static struct command_line line;
static char text[200];
static const char *wrong;

void setUp(void)
{
    wrong = NULL;
}

void tearDown(void)
{
}

static bool parse(const char *words)
{
    (void)snprintf(text, sizeof text, "%s", words);
    return command_line_parse(&line, text, &wrong);
}

static void test_all_has_a_default(void)
{
    TEST_ASSERT_TRUE(parse(""));
    TEST_ASSERT_EQUAL_UINT8(1, line.node);
    TEST_ASSERT_FALSE(line.fifo || line.fast || line.verbose);
    TEST_ASSERT_EQUAL_STRING("out", line.out);
    TEST_ASSERT_EQUAL_STRING("in", line.in);
}

static void test_all_can_be_said(void)
{
    TEST_ASSERT_TRUE(parse("  node=127 link=fifo  out=/tmp/a in=/tmp/b pace=fast verbose "));
    TEST_ASSERT_EQUAL_UINT8(127, line.node);
    TEST_ASSERT_TRUE(line.fifo && line.fast && line.verbose);
    TEST_ASSERT_EQUAL_STRING("/tmp/a", line.out);
    TEST_ASSERT_EQUAL_STRING("/tmp/b", line.in);
}

static void test_the_last_word_counts(void)
{
    TEST_ASSERT_TRUE(parse("link=fifo pace=fast link=slcan pace=real-time node=3 node=4"));
    TEST_ASSERT_FALSE(line.fifo || line.fast);
    TEST_ASSERT_EQUAL_UINT8(4, line.node);
}

static void test_a_wrong_word_is_named(void)
{
    static const char *const words[] = {
        "node=0", "node=128", "node=", "node=1x", "node=99999999999", "node",  "link=can",
        "pace=",  "out=",     "in=",   "verbos",  "verbose=1",        "Node=1"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; ++i) {
        char both[64];
        (void)snprintf(both, sizeof both, "node=5 %s verbose", words[i]);
        TEST_ASSERT_FALSE_MESSAGE(parse(both), words[i]);
        TEST_ASSERT_EQUAL_STRING(words[i], wrong);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_has_a_default);
    RUN_TEST(test_all_can_be_said);
    RUN_TEST(test_the_last_word_counts);
    RUN_TEST(test_a_wrong_word_is_named);
    return UNITY_END();
}
