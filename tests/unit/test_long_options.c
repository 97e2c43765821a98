/* SPDX-License-Identifier: MIT */
/* Tests of port/linux/long_options.h: reads the command line of a program, one option after the other, by
 * getopt_long. Run by `make unit`; no I/O. */
#include "port/linux/long_options.h"

#include <stdint.h>
#include <string.h>

#include "unity.h"

static const struct option known[] = {
    {"bus", required_argument, NULL, 'b'}, {"verbose", no_argument, NULL, 'v'}, {NULL, 0, NULL, 0}};

static char reason[80];
static struct long_options line;

void setUp(void)
{
    reason[0] = '\0';
}

void tearDown(void)
{
}

/* Words up to a NULL. */
static void begin(const char *const *words)
{
    static char *argv[8];
    int argc = 0;
    for (; words[argc] != NULL; ++argc) {
        argv[argc] = (char *)(uintptr_t)words[argc];
    }
    line = long_options_begin(argc, argv, known, reason, sizeof reason);
}

static void test_options_and_their_values(void)
{
    const char *const words[] = {"x", "--bus", "vcan0", "--verbose", "--bus=vcan1", NULL};
    begin(words);
    TEST_ASSERT_EQUAL_INT('b', long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING("vcan0", line.value);
    TEST_ASSERT_EQUAL_INT('v', long_options_next(&line));
    TEST_ASSERT_NULL(line.value);
    TEST_ASSERT_EQUAL_INT('b', long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING("vcan1", line.value);
    TEST_ASSERT_EQUAL_INT(LONG_OPTIONS_END, long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING("", reason);
}

/* The second option of the command line is wrong, the first one is not. */
static void refused(const char *second, const char *text)
{
    const char *const words[] = {"x", "--verbose", second, NULL};
    begin(words);
    TEST_ASSERT_EQUAL_INT('v', long_options_next(&line));
    TEST_ASSERT_EQUAL_INT(LONG_OPTIONS_WRONG, long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING(text, reason);
}

static void test_what_is_wrong(void)
{
    refused("--bus", "a value must follow the option --bus (see --help)");
    refused("--bos", "unknown option --bos (see --help)");
    refused("-v", "unknown option -v (see --help)");
    refused("--verbose=1", "unknown option --verbose=1 (see --help)");
    refused("vcan0", "unknown option vcan0 (see --help)");
}

static void test_texts_of_the_program(void)
{
    const char *const missing[] = {"x", "--bus", NULL};
    const char *const extra[] = {"x", "vcan0", NULL};
    begin(missing);
    line.no_value = "no value after";
    TEST_ASSERT_EQUAL_INT(LONG_OPTIONS_WRONG, long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING("no value after --bus (see --help)", reason);
    begin(extra);
    line.quoted = true;
    line.unknown = "what is";
    TEST_ASSERT_EQUAL_INT(LONG_OPTIONS_WRONG, long_options_next(&line));
    TEST_ASSERT_EQUAL_STRING("what is 'vcan0' (see --help)", reason);
}

static void test_a_long_word_is_cut(void)
{
    const char *const words[] = {
        "x",
        "0123456789012345678901234567890123456789012345678901234567890123456789012345678901234567",
        NULL};
    begin(words);
    TEST_ASSERT_EQUAL_INT(LONG_OPTIONS_WRONG, long_options_next(&line));
    TEST_ASSERT_EQUAL_UINT(sizeof reason - 1, strlen(reason));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_options_and_their_values);
    RUN_TEST(test_what_is_wrong);
    RUN_TEST(test_texts_of_the_program);
    RUN_TEST(test_a_long_word_is_cut);
    return UNITY_END();
}
