/* SPDX-License-Identifier: MIT */
/* The messages go to stderr and are checked in tests/system. Run by `make unit`; prints to stderr. */
#include "port/linux/options.h"

#include "unity.h"

static struct options options;

void setUp(void)
{
}

void tearDown(void)
{
}

static enum options_result parse(int argc, const char *const *words)
{
    char *argv[10];
    for (int i = 0; i < argc; ++i) {
        argv[i] = (char *)(uintptr_t)words[i];
    }
    return options_parse(&options, argc, argv);
}

static void test_all_of_them(void)
{
    const char *const words[] = {"x",      "--bus", "can1",      "--node", "17",
                                 "--pace", "fast",  "--verbose", "--ring", "48"};
    TEST_ASSERT_EQUAL_INT(OPTIONS_OK, parse(10, words));
    TEST_ASSERT_EQUAL_UINT32(48, options.ring_kib);
    TEST_ASSERT_EQUAL_STRING("can1", options.bus);
    TEST_ASSERT_EQUAL_UINT8(17, options.node);
    TEST_ASSERT_EQUAL_INT(OPTIONS_FAST, options.pace);
    TEST_ASSERT_TRUE(options.verbose);
}

static void test_defaults(void)
{
    const char *const words[] = {"x", "--bus", "vcan0"};
    TEST_ASSERT_EQUAL_INT(OPTIONS_OK, parse(3, words));
    TEST_ASSERT_EQUAL_UINT8(1, options.node);
    TEST_ASSERT_EQUAL_UINT32(16384, options.ring_kib);
    TEST_ASSERT_EQUAL_INT(OPTIONS_REAL_TIME, options.pace);
    TEST_ASSERT_FALSE(options.verbose);
}

static void test_mistakes(void)
{
    static const char *const wrong[][4] = {
        {"x", "--bus", "vcan0", "--node"}, {"x", "--node", "0", NULL},
        {"x", "--node", "128", NULL},      {"x", "--node", "2x", NULL},
        {"x", "--pace", "slow", NULL},     {"x", "--speed", "1", NULL},
        {"x", "--verbose", NULL, NULL},    {"x", "--ring", "0", NULL},
        {"x", "--ring", "16385", NULL},    {"x", "--ring", "48k", NULL},
    };
    for (unsigned i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        int argc = 0;
        while (argc < 4 && wrong[i][argc] != NULL) {
            argc++;
        }
        TEST_ASSERT_EQUAL_INT(OPTIONS_WRONG, parse(argc, wrong[i]));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_of_them);
    RUN_TEST(test_defaults);
    RUN_TEST(test_mistakes);
    return UNITY_END();
}
