/* SPDX-License-Identifier: MIT */
/* Tests of core/program_check.h: every golden program, good and broken, gets the code and the index that
 * tests/data/manifest.txt names. Run by `make unit`. Reads tests/data. */
#include "core/program_check.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "golden.h"
#include "unity.h"

enum { PREIMAGE_AT = 24 }; /* in a planar segment; docs/reference/protocol.md 1.2 */

void setUp(void)
{
}

void tearDown(void)
{
}

static int scan_limits(const char *line, struct program_limits *l)
{
    return sscanf(line,
                  "limits %" SCNu32 " us %" SCNu32 " um/s %" SCNu32 " um/s^2 %" SCNu32
                  " mm/s^3 %" SCNd64 " %" SCNd64 " %" SCNd64 " %" SCNd64 " q40_mm %" SCNu32 " ms",
                  &l->period_us, &l->feed_um_s, &l->acceleration_um_s2, &l->jerk_mm_s3,
                  &l->min_q40_mm[0], &l->min_q40_mm[1], &l->max_q40_mm[0], &l->max_q40_mm[1],
                  &l->stop_time_ms) == 9;
}

static void check_file(const char *name, const struct program_limits *limits, int code,
                       uint32_t index)
{
    struct program p;
    struct program_fault fault = {0, 0};
    uint32_t size = 0;
    uint8_t *image = golden_load(name, &size);
    TEST_ASSERT_NOT_NULL_MESSAGE(image, name);
    int found = program_open(&p, image, size);
    if (found == 0) {
        found = program_check(&p, limits, &fault);
        TEST_ASSERT_EQUAL_INT_MESSAGE(found, fault.code, name);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(code, found, name);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(index, fault.index, name);
    TEST_ASSERT_NOT_EQUAL(0, strcmp(program_error_text(found), program_error_text(1)));
    free(image);
}

static void test_golden_programs(void)
{
    struct program_limits limits = {.period_us = 0};
    char line[256];
    char name[128];
    char word[64];
    int code = 0;
    int files = 0;
    uint32_t index = 0;
    FILE *manifest = fopen("tests/data/manifest.txt", "r");
    TEST_ASSERT_NOT_NULL(manifest);
    while (fgets(line, sizeof line, manifest) != NULL) {
        if (line[0] == '#' || scan_limits(line, &limits)) {
            continue;
        }
        TEST_ASSERT_EQUAL_INT(4, sscanf(line, "%127s %63s %d %" SCNu32, name, word, &code, &index));
        check_file(name, &limits, code, index);
        files++;
    }
    fclose(manifest);
    TEST_ASSERT_GREATER_THAN_INT(50, files);
}

/* The peak feed of a good program in um/s, found through the check itself. */
static uint32_t least_feed_limit(const struct program *p, struct program_limits limits)
{
    struct program_fault fault;
    uint32_t low = 0;
    uint32_t high = 10000000;
    while (high - low > 1) {
        limits.feed_um_s = low + (high - low) / 2;
        if (program_check(p, &limits, &fault) == 0) {
            high = limits.feed_um_s;
        } else {
            TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_FEED, fault.code);
            low = limits.feed_um_s;
        }
    }
    return high;
}

/* The bound is tight: the alpha's constant feed of 100 mm/s passes at 100 mm/s and a thousandth. */
static void test_feed_bound_is_tight(void)
{
    struct program p;
    golden_open(&p, "alpha_quintic.hdgp");
    TEST_ASSERT_UINT32_WITHIN(20, 100000, least_feed_limit(&p, golden_no_limits()));
    golden_close(&p);
}

/* The code of the line with a straight first segment whose preimage is u_0, u_1, u_2. Its speed then has the Bernstein
 * coefficients u_0^2, u_0 u_1, (u_0 u_2 + 2 u_1^2) / 3, u_1 u_2, u_2^2. */
static int code_with_preimage(double u_0, double u_1, double u_2)
{
    const struct program_limits limits = golden_no_limits();
    const double u[3] = {u_0, u_1, u_2};
    struct program p;
    struct program_fault fault;
    golden_open(&p, "line.hdgp");
    uint8_t *a = (uint8_t *)p.image + p.header.header_size + PREIMAGE_AT;
    for (int k = 0; k < 3; k++) {
        const int64_t u_q44 = (int64_t)(u[k] * 0x1p44);
        memcpy(a + 16 * k, &u_q44, 8);
        memset(a + 16 * k + 8, 0, 8);
    }
    const int code = program_check(&p, &limits, &fault);
    if (code == PROGRAM_ERR_SIGMA || code == PROGRAM_ERR_SIGMA_RATIO) {
        TEST_ASSERT_EQUAL_UINT32(0, fault.index);
    }
    golden_close(&p);
    return code;
}

static void expect_ratio_checked(double u_0, double u_1, double u_2, double passing)
{
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIGMA_RATIO, code_with_preimage(u_0, u_1, u_2));
    const int code = code_with_preimage(u_0 == 1.0 ? 1.0 : passing, u_1 == 1.0 ? 1.0 : passing,
                                        u_2 == 1.0 ? 1.0 : passing);
    TEST_ASSERT_NOT_EQUAL(PROGRAM_ERR_SIGMA_RATIO, code);
    TEST_ASSERT_NOT_EQUAL(PROGRAM_ERR_SIGMA, code);
}

/* The greatest coefficient of the speed is at most twice the least one, wherever it is. */
static void test_speed_ratio_is_tight(void)
{
    expect_ratio_checked(1.415, 1.0, 1.0, 1.414);
    expect_ratio_checked(1.0, 1.0, 1.415, 1.414);
    expect_ratio_checked(1.0, 1.5812, 1.0, 1.5811); /* that in the middle */
    expect_ratio_checked(1.0, 0.4999, 1.0, 0.5001);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIGMA, code_with_preimage(1.0, -0.5, 1.0));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIGMA, code_with_preimage(1.0, 0.0, 1.0));
}

/* The alpha starts at its least x. */
static void test_travel_is_tight(void)
{
    struct program p;
    struct program_fault fault;
    struct program_limits limits = golden_no_limits();
    struct program_segment first;
    golden_open(&p, "alpha_quintic.hdgp");
    program_segment_get(&p, 0, &first);
    limits.min_q40_mm[0] = first.point_q40_mm[0];
    TEST_ASSERT_EQUAL_INT(0, program_check(&p, &limits, &fault));
    limits.min_q40_mm[0] = first.point_q40_mm[0] + ((int64_t)1 << 20);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_TRAVEL, program_check(&p, &limits, &fault));
    TEST_ASSERT_EQUAL_UINT32(0, fault.index);
    golden_close(&p);
}

static void count_call(void *self)
{
    uint32_t *calls = self;
    (*calls)++;
}

static uint32_t calls_of_check(const struct program *p, struct program_limits limits, int expected)
{
    struct program_fault fault;
    uint32_t calls = 0;
    limits.attend = count_call;
    limits.self = &calls;
    TEST_ASSERT_EQUAL_INT(expected, program_check(p, &limits, &fault));
    return calls;
}

/* The least velocity of x in um/s with which a program is accepted. */
static uint32_t least_velocity_limit(const struct program *p, struct program_limits limits)
{
    struct program_fault fault;
    uint32_t low = 1;
    uint32_t high = 10000000;
    while (high - low > 1) {
        limits.axis_velocity_um_s[0] = low + (high - low) / 2;
        if (program_check(p, &limits, &fault) == 0) {
            high = limits.axis_velocity_um_s[0];
        } else {
            low = limits.axis_velocity_um_s[0];
        }
    }
    return high;
}

/* A main loop has work to do while segments, pieces, their limits and both kinds of stops are checked, and at each of
 * the many parts of a piece near the limits of an axis. */
static void test_a_check_attends_to_other_work_all_the_time(void)
{
    struct program p;
    struct program_limits limits = golden_no_limits();
    golden_open(&p, "alpha_quintic.hdgp");
    limits.axis_velocity_um_s[0] = 10000000;
    const uint32_t far_off = calls_of_check(&p, limits, 0);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(p.header.segment_count + 4u * p.header.piece_count,
                                        far_off);
    limits.axis_velocity_um_s[0] = least_velocity_limit(&p, limits);
    TEST_ASSERT_GREATER_THAN_UINT32(far_off + 10u, calls_of_check(&p, limits, 0));
    golden_close(&p);
}

/* Each bit of an image counts: flipped, it is refused by the CRC. */
static void test_any_flipped_bit_is_refused(void)
{
    struct program p;
    uint32_t size = 0;
    uint8_t *image = golden_load("line.hdgp", &size);
    TEST_ASSERT_NOT_NULL(image);
    for (uint32_t bit = 0; bit < 8 * size; bit++) {
        image[bit / 8] ^= (uint8_t)(1u << (bit % 8));
        TEST_ASSERT_LESS_THAN_INT(0, program_open(&p, image, size));
        image[bit / 8] ^= (uint8_t)(1u << (bit % 8));
    }
    TEST_ASSERT_EQUAL_INT(0, program_open(&p, image, size));
    free(image);
}

static void test_truncation_at_any_byte_is_refused(void)
{
    struct program p;
    uint32_t size = 0;
    uint8_t *image = golden_load("line.hdgp", &size);
    TEST_ASSERT_NOT_NULL(image);
    for (uint32_t cut = 0; cut < size; cut++) {
        uint8_t *part = malloc(cut + 1u);
        memcpy(part, image, cut);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_open(&p, part, cut));
        free(part);
    }
    free(image);
}

static void test_unknown_code_has_a_text(void)
{
    TEST_ASSERT_EQUAL_STRING("unknown error", program_error_text(-999));
    TEST_ASSERT_EQUAL_STRING("no error", program_error_text(0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_golden_programs);
    RUN_TEST(test_feed_bound_is_tight);
    RUN_TEST(test_speed_ratio_is_tight);
    RUN_TEST(test_travel_is_tight);
    RUN_TEST(test_a_check_attends_to_other_work_all_the_time);
    RUN_TEST(test_any_flipped_bit_is_refused);
    RUN_TEST(test_truncation_at_any_byte_is_refused);
    RUN_TEST(test_unknown_code_has_a_text);
    return UNITY_END();
}
