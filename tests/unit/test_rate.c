/* SPDX-License-Identifier: MIT */
#include "core/rate.h"

#include "core/qmath.h"
#include "golden.h"
#include "unity.h"

static uint64_t random_state;

void setUp(void)
{
    random_state = 11;
}

void tearDown(void)
{
}

static int64_t below(int64_t most)
{
    return (int64_t)(golden_random(&random_state) % (uint64_t)most);
}

static struct rate_bounds random_bounds(void)
{
    struct rate_bounds b = {RATE_MOST, 0, 0};
    b.slope_q56 = 1 + (RATE_SLOPE_MOST >> below(13)) - below(1000);
    b.second_q56 = 1 + (RATE_SLOPE_MOST >> below(22)) - below(1000);
    return b;
}

/* From any state that a rate can be in: there in finite time, exactly, inside the bounds, in no more than the program time
 * that rate_span says, and not beyond the target unless it has to. */
static void check_way(const struct rate *from, int64_t target, const struct rate_bounds *b)
{
    struct rate rate = *from;
    const struct rate_stop stop = rate_stop(&rate, b->second_q56);
    int64_t span = rate_span_q12(&rate, &stop, target, b);
    int64_t rest = stop.rest_q57;
    int rising = target >= rate.rate_q57;
    int beyond = rising ? rest > target : rest < target;
    double time_q12 = 0;
    for (int n = 0; rate.slope_q56 != 0 || rate.rate_q57 < target - 1 || rate.rate_q57 > target + 1;
         n++) {
        struct rate before = rate;
        TEST_ASSERT_TRUE(n < 3000000);
        rate_move(&rate, rate_next_slope(&rate, target, b));
        TEST_ASSERT_TRUE(rate.rate_q57 - before.rate_q57 == before.slope_q56 + rate.slope_q56);
        int64_t second = rate.slope_q56 - before.slope_q56;
        TEST_ASSERT_TRUE(second <= b->second_q56 && second >= -b->second_q56);
        TEST_ASSERT_TRUE(rate.slope_q56 <= b->slope_q56 && rate.slope_q56 >= -b->slope_q56);
        TEST_ASSERT_TRUE(beyond || (rising ? rate.rate_q57 <= target : rate.rate_q57 >= target));
        TEST_ASSERT_TRUE(before.slope_q56 != 0 || before.rate_q57 != rate.rate_q57 ||
                         rate.slope_q56 != 0);
        time_q12 +=
            ((double)before.rate_q57 * 3 + (double)before.slope_q56 * 2 + (double)rate.slope_q56) /
            6 / 17592186044416.0;
    }
    TEST_ASSERT_TRUE(span == INT64_MAX || time_q12 <= (double)span);
}

static void test_reaches_the_target(void)
{
    for (int i = 0; i < 3000; i++) {
        struct rate_bounds b = random_bounds();
        struct rate from = {below(RATE_MOST + 1), 0};
        from.slope_q56 = below(2 * b.slope_q56 + 1) - b.slope_q56;
        int64_t rest = rate_stop(&from, b.second_q56).rest_q57;
        from.slope_q56 = rest < 0 || rest > RATE_MOST || i % 3 == 0 ? 0 : from.slope_q56;
        int64_t target = i % 4 == 0 ? 0 : i % 4 == 1 ? RATE_ONE : below(RATE_MOST + 1);
        check_way(&from, target, &b);
    }
}

/* From rest the way takes as long as the continuous one within a few ticks: (rise / rate + rate / second) or 2 sqrt(rise /
 * second). */
static void test_is_as_fast_as_can_be(void)
{
    const struct rate_bounds flat = {RATE_MOST, RATE_SLOPE_MOST / 100, RATE_SLOPE_MOST / 1000};
    const struct rate_bounds peaked = {RATE_MOST, RATE_SLOPE_MOST, RATE_SLOPE_MOST / 10000};
    const struct rate_bounds *bounds[2] = {&flat, &peaked};
    const int ticks[2] = {100 + 10, 200};
    for (int i = 0; i < 2; i++) {
        struct rate rate = {RATE_ONE, 0};
        int n = 0;
        for (; rate.rate_q57 > 1 || rate.slope_q56 != 0; n++) {
            TEST_ASSERT_TRUE(n < 1000);
            rate_move(&rate, rate_next_slope(&rate, 0, bounds[i]));
        }
        TEST_ASSERT_INT_WITHIN(2, ticks[i] + 1, n);
    }
}

static void test_rest_far_away_is_held(void)
{
    struct rate rate = {RATE_ONE, RATE_SLOPE_MOST};
    TEST_ASSERT_TRUE(rate_stop(&rate, 1).rest_q57 > 4 * RATE_MOST);
    rate.slope_q56 = -RATE_SLOPE_MOST;
    TEST_ASSERT_TRUE(rate_stop(&rate, 1).rest_q57 < -RATE_MOST);
    rate.slope_q56 = 0;
    TEST_ASSERT_TRUE(rate_stop(&rate, 1).rest_q57 == RATE_ONE);
}

static void test_root(void)
{
    TEST_ASSERT_EQUAL_UINT64(0, qmath_root(0));
    TEST_ASSERT_EQUAL_UINT64(UINT32_MAX, qmath_root(UINT64_MAX));
    for (int i = 0; i < 100000; i++) {
        uint64_t a = golden_random(&random_state) >> below(64);
        uint64_t root = qmath_root(a);
        TEST_ASSERT_TRUE(root * root <= a);
        TEST_ASSERT_TRUE(root == UINT32_MAX || (root + 1u) * (root + 1u) > a);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_reaches_the_target);
    RUN_TEST(test_is_as_fast_as_can_be);
    RUN_TEST(test_rest_far_away_is_held);
    RUN_TEST(test_root);
    return UNITY_END();
}
