/* SPDX-License-Identifier: MIT */
/* When a hold may begin at once: far from the end of the program, by the worst stops of its header, or where it fits
 * before the end of the path. Run by `make unit`; reads files of tests/data. */
#include "core/feed_override.h"

#include "golden.h"
#include "unity.h"

enum { TICKS = 100 };

#define UM_Q40   1099511628 /* 2^40 / 1000, rounded up */
#define SHORT_UM 200        /* too short for a hold, longer than a tick */
#define LONG_UM  20000      /* long enough */

static struct program p;
static struct golden_precomputed precomputed;
static struct interpolator it;
static struct feed_override feed;
static struct interpolator_point point;

void setUp(void)
{
    golden_open(&p, "heart_minimax.hdgp");
    golden_precompute(&precomputed, &p, KERNEL_FIXED);
}

void tearDown(void)
{
    golden_discard(&precomputed);
    golden_close(&p);
}

/* To the middle of the program, at 100 %. */
static void run(void)
{
    feed_override_begin(&feed, &precomputed.program, p.header.period_us, 0);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &precomputed.program));
    for (int k = 0; k < TICKS; k++) {
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&feed, &it, &point));
    }
}

/* The first tick of a hold with so much path left: the override is 0 in a brake. */
static int brakes_at_once(int64_t left_um, uint32_t worst_um, uint32_t worst_us)
{
    run();
    precomputed.program.header.length_q40_mm = point.arc_length_q40_mm + left_um * UM_Q40;
    precomputed.program.header.hold_worst_um = worst_um;
    precomputed.program.header.hold_worst_us = worst_us;
    feed_override_hold(&feed);
    TEST_ASSERT_EQUAL_INT(0, feed_override_next(&feed, &it, &point));
    return feed_override_actual_q30(&feed) == 0u;
}

/* As long as the remaining distance is enough: not when a micrometre of it is missing. */
static void test_way_to_the_end(void)
{
    TEST_ASSERT_TRUE(brakes_at_once(SHORT_UM, SHORT_UM, 0));
    TEST_ASSERT_FALSE(brakes_at_once(SHORT_UM, SHORT_UM + 1u, 0));
}

static void test_time_to_the_end(void)
{
    run();
    const uint64_t left_q42_s = (p.header.duration_q32_s << 10) - feed_override_time_q42(&feed);
    const uint32_t left_us = (uint32_t)((double)left_q42_s * 1e6 / 4398046511104.0);
    TEST_ASSERT_TRUE(left_us > 1000u);
    TEST_ASSERT_TRUE(brakes_at_once(SHORT_UM, 0, left_us));
    TEST_ASSERT_FALSE(brakes_at_once(SHORT_UM, 0, left_us + 1u));
}

/* Nearer than the worst stop, in the first tick too, where this one fits. */
static void test_fits_before_the_end(void)
{
    TEST_ASSERT_TRUE(brakes_at_once(LONG_UM, UINT32_MAX, UINT32_MAX));
    TEST_ASSERT_FALSE(brakes_at_once(SHORT_UM, UINT32_MAX, UINT32_MAX));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_way_to_the_end);
    RUN_TEST(test_time_to_the_end);
    RUN_TEST(test_fits_before_the_end);
    return UNITY_END();
}
