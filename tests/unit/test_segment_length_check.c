/* SPDX-License-Identifier: MIT */
/* Which pieces count for a stretch of two segments: those that reach into it, with the slack of a piece's ends. Run
 * by `make unit`; reads files of tests/data. */
#include "core/segment_length_check.h"

#include "canopen/cob.h"
#include "core/feed_bounds.h"
#include "golden.h"
#include "unity.h"

#define REACH_Q40 (FEED_PIECE_SLACK_Q36 * 32)
#define FAST_Q40  (INT64_C(1) << 53) /* 8 m in one piece */

static struct program program;

void setUp(void)
{
    golden_open(&program, "alpha_quintic.hdgp");
    TEST_ASSERT_GREATER_THAN_UINT32(5, program.header.segment_count);
}

void tearDown(void)
{
    golden_close(&program);
}

static int64_t start_of(uint32_t piece)
{
    struct program_piece found;
    program_piece_get(&program, piece, &found);
    return found.start_q40_mm;
}

static void make_fast(uint32_t piece, int64_t start_q40)
{
    uint8_t *bytes = (uint8_t *)program.image + PROGRAM_HEADER_SIZE +
                     (size_t)program.header.segment_count * PROGRAM_SEGMENT_SIZE +
                     (size_t)piece * PROGRAM_PIECE_SIZE;
    cob_put(bytes + 8, (uint64_t)start_q40, 8);
    cob_put(bytes + 16, (uint64_t)FAST_Q40, 8);
    TEST_ASSERT_EQUAL_INT64(start_q40, start_of(piece));
}

static uint32_t first_beyond(int64_t q40)
{
    uint32_t piece = 0;
    while (start_of(piece) <= q40) {
        piece++;
        TEST_ASSERT_LESS_THAN_UINT32(program.header.piece_count, piece);
    }
    return piece;
}

/* Segments 1 and 2 end at the start of segment 3. */
static uint32_t refused_with_a_fast_piece_beyond_them(int64_t by_q40)
{
    const int64_t start = program_segment_start(&program, 3) + by_q40;
    uint32_t index = 0;
    make_fast(first_beyond(start), start);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SEGMENT_SHORT, segment_length_check_all(&program, &index));
    return index;
}

static void test_the_program_as_it_is(void)
{
    uint32_t index = 77;
    TEST_ASSERT_EQUAL_INT(0, segment_length_check_all(&program, &index));
    TEST_ASSERT_EQUAL_UINT32(0, index);
}

static void test_a_piece_that_begins_within_the_slack_counts(void)
{
    TEST_ASSERT_EQUAL_UINT32(2, refused_with_a_fast_piece_beyond_them(REACH_Q40));
}

static void test_a_piece_that_begins_beyond_it_counts_for_the_next_two(void)
{
    TEST_ASSERT_EQUAL_UINT32(3, refused_with_a_fast_piece_beyond_them(REACH_Q40 + 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_program_as_it_is);
    RUN_TEST(test_a_piece_that_begins_within_the_slack_counts);
    RUN_TEST(test_a_piece_that_begins_beyond_it_counts_for_the_next_two);
    return UNITY_END();
}
