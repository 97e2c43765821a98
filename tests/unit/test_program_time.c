/* SPDX-License-Identifier: MIT */
/* Tests of core/program_time.h: the program time at which a program comes to an arc length. Run by `make unit`;
 * reads files of tests/data. */
#include "core/program_time.h"

#include "core/interpolator.h"
#include "golden.h"
#include "unity.h"

static struct program p;
static struct golden_precomputed precomputed;
static struct interpolator it;
static struct interpolator_point point;

void setUp(void)
{
    golden_open(&p, "heart_minimax.hdgp");
    golden_precompute(&precomputed, &p, KERNEL_FIXED);
    interpolator_begin(&it, &precomputed.program);
}

void tearDown(void)
{
    golden_discard(&precomputed);
    golden_close(&p);
}

static int64_t arc_at(uint64_t time_q42_s)
{
    interpolator_seek(&it, time_q42_s >> 10);
    interpolator_at_q42(&it, time_q42_s, &point);
    return point.arc_length_q40_mm;
}

/* There at that time, not yet just before it. */
static void test_any_arc_length(void)
{
    uint64_t random = 5;
    for (int i = 0; i < 2000; i++) {
        int64_t arc =
            1 + (int64_t)(golden_random(&random) % (uint64_t)(p.header.length_q40_mm - 1));
        uint64_t time = program_time_at_q42(&p, arc);
        TEST_ASSERT_TRUE(arc_at(time) >= arc);
        TEST_ASSERT_TRUE(arc_at(time - 1u) < arc);
        TEST_ASSERT_TRUE(arc_at(time) - arc < 200); /* distance of 2^-42 s at 100 mm/s: 25 units */
    }
}

static void test_ends_and_joints(void)
{
    const uint64_t duration = p.header.duration_q32_s << 10;
    struct program_piece piece;
    TEST_ASSERT_EQUAL_UINT64(0, program_time_at_q42(&p, 0));
    TEST_ASSERT_EQUAL_UINT64(0, program_time_at_q42(&p, -5));
    TEST_ASSERT_EQUAL_UINT64(duration, program_time_at_q42(&p, p.header.length_q40_mm));
    TEST_ASSERT_EQUAL_UINT64(duration, program_time_at_q42(&p, INT64_MAX));
    uint64_t start_q32_s = 0;
    for (uint32_t i = 0; i < p.header.piece_count; i++) {
        program_piece_get(&p, i, &piece);
        uint64_t time = program_time_at_q42(&p, piece.start_q40_mm);
        TEST_ASSERT_TRUE(time <= start_q32_s << 10);
        TEST_ASSERT_TRUE(i == 0 || arc_at(time) >= piece.start_q40_mm - 1);
        start_q32_s += piece.duration_q32_s;
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_any_arc_length);
    RUN_TEST(test_ends_and_joints);
    return UNITY_END();
}
