/* SPDX-License-Identifier: MIT */
/* Tests of core/program.h: reading header, segments, feed pieces and stops of a program image. Run by `make unit`;
 * reads files of tests/data. */
#include "core/program.h"

#include <stdlib.h>
#include <string.h>

#include "compact_image.h"
#include "core/counts.h"
#include "core/crc32.h"
#include "core/little_endian.h"
#include "golden.h"
#include "unity.h"

static struct program p;

void setUp(void)
{
    golden_open(&p, "heart_exponential.hdgp");
}

void tearDown(void)
{
    golden_close(&p);
}

static void test_crc_of_the_standard_check_string(void)
{
    const uint8_t check[] = "123456789";
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(0, check, 9));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(crc32_update(0, check, 4), check + 4, 5));
    TEST_ASSERT_EQUAL_HEX32(0, crc32_update(0, check, 0));
}

static void test_header_is_read(void)
{
    TEST_ASSERT_EQUAL_UINT32(1000, p.header.period_us);
    TEST_ASSERT_EQUAL_UINT32(PROGRAM_FLAG_CLOSED, p.header.flags);
    TEST_ASSERT_EQUAL_UINT32(p.size,
                             PROGRAM_HEADER_SIZE + p.header.segment_count * PROGRAM_SEGMENT_SIZE +
                                 p.header.piece_count * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE));
    TEST_ASSERT_EQUAL_CHAR('\0', p.header.name[32]);
}

/* The first segment starts at (-20 - 35i)/6, the paper's first nodal point of the heart. */
static void test_segment_is_read(void)
{
    struct program_segment g;
    program_segment_get(&p, 0, &g);
    TEST_ASSERT_EQUAL_INT64(0, g.start_q40_mm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -20.0 / 6.0, (double)g.point_q40_mm[0] / 1099511627776.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -35.0 / 6.0, (double)g.point_q40_mm[1] / 1099511627776.0);
    program_segment_get(&p, 1, &g);
    TEST_ASSERT_EQUAL_INT64(program_segment_start(&p, 1), g.start_q40_mm);
}

static void test_pieces_sum_up(void)
{
    uint64_t sum = 0;
    struct program_piece c;
    for (uint32_t i = 0; i < p.header.piece_count; i++) {
        program_piece_get(&p, i, &c);
        TEST_ASSERT_EQUAL_UINT64(program_piece_duration(&p, i), c.duration_q32_s);
        sum += c.duration_q32_s;
    }
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s, sum);
}

static void expect_same_segments(const struct program *compact)
{
    for (uint32_t i = 0; i < p.header.segment_count; i++) {
        struct program_segment one;
        struct program_segment other;
        memset(&one, 0, sizeof one);
        memset(&other, 0, sizeof other);
        program_segment_get(&p, i, &one);
        program_segment_get(compact, i, &other);
        TEST_ASSERT_EQUAL_MEMORY(&one, &other, sizeof one);
        TEST_ASSERT_EQUAL_INT64(program_segment_start(&p, i), program_segment_start(compact, i));
        TEST_ASSERT_TRUE(program_segment_alike(&p, i, compact, i));
        TEST_ASSERT_TRUE(i == 0u || !program_segment_alike(&p, i - 1u, compact, i));
    }
}

static void expect_same_pieces(const struct program *compact)
{
    for (uint32_t i = 0; i < p.header.piece_count; i++) {
        struct program_piece one;
        struct program_piece other;
        memset(&one, 0, sizeof one);
        memset(&other, 0, sizeof other);
        program_piece_get(&p, i, &one);
        program_piece_get(compact, i, &other);
        TEST_ASSERT_EQUAL_MEMORY(&one, &other, sizeof one);
        TEST_ASSERT_EQUAL_UINT64(program_piece_duration(&p, i), program_piece_duration(compact, i));
        TEST_ASSERT_EQUAL_INT64(program_piece_start(&p, i), program_piece_start(compact, i));
        TEST_ASSERT_TRUE(program_piece_alike(&p, i, compact, i));
        for (int kind = PROGRAM_STOP_HOLD; kind <= PROGRAM_STOP_FAULT; kind++) {
            struct program_stop stop;
            struct program_stop same;
            program_stop_get(&p, i, (enum program_stop_kind)kind, &stop);
            program_stop_get(compact, i, (enum program_stop_kind)kind, &same);
            TEST_ASSERT_EQUAL_UINT8(stop.jerk_down, same.jerk_down);
            TEST_ASSERT_EQUAL_UINT8(stop.deceleration, same.deceleration);
            TEST_ASSERT_EQUAL_UINT8(stop.jerk_up, same.jerk_up);
            TEST_ASSERT_EQUAL_UINT32(stop.bound_us, same.bound_us);
            TEST_ASSERT_EQUAL_UINT16(0, same.reserved);
        }
    }
}

/* In the plane, with events, in space, and with extra axes. */
static void test_compact_records_have_the_same_numbers(void)
{
    static const char *const names[] = {"heart_exponential.hdgp", "alpha_events.hdgp",
                                        "space3.hdgp", "space6.hdgp"};
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        struct program compact;
        struct program_fault fault;
        struct program_limits limits = golden_no_limits();
        golden_close(&p);
        golden_open(&p, names[k]);
        uint8_t *image = malloc(p.size);
        const uint32_t size = compact_image(image, p.image);
        TEST_ASSERT_LESS_THAN_UINT32(p.size, size);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_open(&compact, image, size - 1u));
        TEST_ASSERT_EQUAL_INT(0, program_open(&compact, image, size));
        expect_same_segments(&compact);
        expect_same_pieces(&compact);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_FLAGS, program_check(&compact, &limits, &fault));
        limits.chunk = 1;
        TEST_ASSERT_EQUAL_INT(0, program_check(&compact, &limits, &fault));
        free(image);
    }
}

static void test_ticks(void)
{
    p.header.period_us = 8000;
    p.header.duration_q32_s = (uint64_t)1 << 32; /* 125 periods exactly */
    TEST_ASSERT_EQUAL_UINT32(126, program_ticks(&p));
    p.header.duration_q32_s++;
    TEST_ASSERT_EQUAL_UINT32(127, program_ticks(&p));
    p.header.duration_q32_s -= 2;
    TEST_ASSERT_EQUAL_UINT32(126, program_ticks(&p));
    p.header.period_us = 1000;
    p.header.duration_q32_s = 1;
    TEST_ASSERT_EQUAL_UINT32(2, program_ticks(&p));
    p.header.duration_q32_s = (uint64_t)1 << 54;
    TEST_ASSERT_EQUAL_UINT32(4194304001u, program_ticks(&p));
}

static void test_exponent(void)
{
    TEST_ASSERT_EQUAL_INT(-32, program_piece_exponent(1));
    TEST_ASSERT_EQUAL_INT(-31, program_piece_exponent(2));
    TEST_ASSERT_EQUAL_INT(-30, program_piece_exponent(3));
    TEST_ASSERT_EQUAL_INT(0, program_piece_exponent((uint64_t)1 << 32));
    TEST_ASSERT_EQUAL_INT(1, program_piece_exponent(((uint64_t)1 << 32) + 1));
    TEST_ASSERT_EQUAL_INT(22, program_piece_exponent((uint64_t)1 << 54));
    TEST_ASSERT_EQUAL_INT(31, program_piece_exponent(UINT64_MAX));
}

static void test_counts(void)
{
    const int64_t half = (int64_t)1 << 39;
    TEST_ASSERT_EQUAL_INT32(0, counts_from_q40_mm(0, 1000000));
    TEST_ASSERT_EQUAL_INT32(1000000, counts_from_q40_mm(2 * half, 1000000));
    TEST_ASSERT_EQUAL_INT32(1, counts_from_q40_mm(half, 1));
    TEST_ASSERT_EQUAL_INT32(0, counts_from_q40_mm(half - 1, 1));
    TEST_ASSERT_EQUAL_INT32(0, counts_from_q40_mm(-half, 1));
    TEST_ASSERT_EQUAL_INT32(-1, counts_from_q40_mm(-half - 1, 1));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, counts_from_q40_mm((int64_t)3000 << 40, 1000000));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, counts_from_q40_mm(-((int64_t)3000 << 40), 1000000));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, counts_from_q40_mm(INT64_MAX, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, counts_from_q40_mm(INT64_MIN, UINT32_MAX));
    TEST_ASSERT_EQUAL_INT32(0, counts_from_q40_mm(INT64_MAX, 0));
}

static void test_integers_at_the_ends_of_their_fields(void)
{
    static const uint8_t least[] = {0, 0, 0, 0, 0, 0, 0x80};
    static const uint8_t most[] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F};
    static const uint8_t minus_one[] = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    static const uint8_t counted[] = {1, 2, 3, 4, 5, 6, 7};
    TEST_ASSERT_EQUAL_INT64(-((int64_t)1 << 55), read_i56(least));
    TEST_ASSERT_EQUAL_INT64(((int64_t)1 << 55) - 1, read_i56(most));
    TEST_ASSERT_EQUAL_INT64(-1, read_i56(minus_one));
    TEST_ASSERT_EQUAL_INT64(0x07060504030201, read_i56(counted));
    TEST_ASSERT_EQUAL_INT64(-((int64_t)1 << 47), read_i48(least + 1));
    TEST_ASSERT_EQUAL_INT64(((int64_t)1 << 47) - 1, read_i48(most + 1));
    TEST_ASSERT_EQUAL_INT64(-1, read_i48(minus_one));
    TEST_ASSERT_EQUAL_INT64(0x060504030201, read_i48(counted));
    TEST_ASSERT_EQUAL_UINT32((1u << 24) - 1u, read_u24(minus_one));
    TEST_ASSERT_EQUAL_UINT32(1u << 23, read_u24(least + 4));
    TEST_ASSERT_EQUAL_UINT32(0x030201u, read_u24(counted));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crc_of_the_standard_check_string);
    RUN_TEST(test_header_is_read);
    RUN_TEST(test_segment_is_read);
    RUN_TEST(test_pieces_sum_up);
    RUN_TEST(test_integers_at_the_ends_of_their_fields);
    RUN_TEST(test_compact_records_have_the_same_numbers);
    RUN_TEST(test_ticks);
    RUN_TEST(test_exponent);
    RUN_TEST(test_counts);
    return UNITY_END();
}
