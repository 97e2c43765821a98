/* SPDX-License-Identifier: MIT */
#include "core/rate.h"

#include <math.h>

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

/* Bounds of the format, R and S in the units of a tick as they are meant, and what is made of them. */
struct bounds {
    struct rate_pace pace;
    double slope;
    double second;
    uint32_t period_us;
};

static struct bounds make_bounds(uint32_t rate_q16_per_s, uint32_t second_q8_per_s2,
                                 uint32_t period_us)
{
    const struct rate_bounds raw = {1u << 25, rate_q16_per_s, second_q8_per_s2};
    const double h = period_us * 1e-6;
    struct bounds b;
    rate_pace_make(&b.pace, &raw, period_us);
    b.slope = fmin(rate_q16_per_s / 65536.0 * h, 1) * 72057594037927936.0;
    b.second = fmin(second_q8_per_s2 / 256.0 * h * h, 1) * 72057594037927936.0;
    b.period_us = period_us;
    return b;
}

static struct bounds random_bounds(void)
{
    uint32_t rate = (uint32_t)(golden_random(&random_state) >> (32 + below(32)));
    uint32_t second = (uint32_t)(golden_random(&random_state) >> (32 + below(32)));
    return make_bounds(rate | 1u, second | 1u, 1000u << below(4));
}

static struct rate_move move_of(const struct bounds *b, const struct rate *from, int64_t target,
                                struct rate_ticks *ticks)
{
    const int64_t way = target - from->rate_q57;
    struct rate_move move;
    rate_ticks_of(ticks, &b->pace, way < 0 ? -way : way);
    int64_t step = rate_step_of(ticks, way < 0 ? -way : way);
    TEST_ASSERT_TRUE((double)step * ticks->rise <= b->slope);
    TEST_ASSERT_TRUE((double)step <= b->second);
    rate_move_begin(&move, from, ticks, way < 0 ? -step : step);
    return move;
}

/* Runs it to its end, or to a cut after so many ticks: the slope changes by the step at most, never beyond what it rises
 * to, and it rests where the move said. Gives the program time in ticks at rate 1. */
static double run(struct rate_move *move, struct rate *rate, uint64_t cut)
{
    const int64_t step = move->step_q56;
    const int64_t most = step * (int64_t)move->rise;
    double time = 0;
    for (uint64_t n = 0; rate_moves(move); n++) {
        const struct rate before = *rate;
        if (n == cut) {
            rate_move_cut(move);
        }
        rate_tick(rate, rate_move_slope(move, rate->slope_q56));
        const int64_t second = rate->slope_q56 - before.slope_q56;
        TEST_ASSERT_TRUE(rate->rate_q57 - before.rate_q57 == before.slope_q56 + rate->slope_q56);
        TEST_ASSERT_TRUE(second == 0 || second == step || second == -step);
        TEST_ASSERT_TRUE(step < 0 ? rate->slope_q56 <= 0 && rate->slope_q56 >= most
                                  : rate->slope_q56 >= 0 && rate->slope_q56 <= most);
        time +=
            ((double)before.rate_q57 * 3 + (double)before.slope_q56 * 2 + (double)rate->slope_q56) /
            6 / 72057594037927936.0;
    }
    TEST_ASSERT_TRUE(rate->slope_q56 == 0);
    TEST_ASSERT_TRUE(rate->rate_q57 == move->rest_q57);
    return time;
}

/* Ticks of the continuous way: with the slope rising to its bound, or not. */
static double fewest(const struct bounds *b, double way)
{
    const double peak = sqrt(way / 2 * b->second);
    return peak <= b->slope ? 2 * sqrt(way / 2 / b->second)
                            : way / 2 / b->slope + b->slope / b->second;
}

static void test_comes_to_the_target(void)
{
    for (int i = 0; i < 20000; i++) {
        const struct bounds b = random_bounds();
        struct rate rate = {below(RATE_MOST + 1), 0};
        const int64_t from = rate.rate_q57;
        const int64_t target = i % 4 == 0   ? 0
                               : i % 4 == 1 ? RATE_ONE
                                            : below(RATE_MOST >> below(40));
        const double way = fabs((double)(target - from));
        struct rate_ticks ticks;
        struct rate_move move = move_of(&b, &rate, target, &ticks);
        const double total = (double)ticks.rise + ticks.half;
        TEST_ASSERT_TRUE(total <= fewest(&b, way) * 1.002 + 4);
        if (total > 10000) {
            continue; /* too long to run */
        }
        const double time = run(&move, &rate, UINT64_MAX);
        const int64_t left = target > from ? target - rate.rate_q57 : rate.rate_q57 - target;
        TEST_ASSERT_TRUE(left >= 0 && left < 2 * (int64_t)ticks.rise * ticks.half);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, total * (double)(from + rate.rate_q57) / 2 / RATE_ONE,
                                  time);
        const uint32_t period_q32_s = (uint32_t)(b.period_us * 4294.967296) + 1u;
        const uint64_t span = rate_span_q32(&ticks, (from + rate.rate_q57) / 2, period_q32_s);
        TEST_ASSERT_TRUE(time * b.period_us * 4294.967296 <= (double)span);
    }
}

static void test_a_cut_ends_where_it_said(void)
{
    for (int i = 0; i < 20000; i++) {
        const struct bounds b = random_bounds();
        struct rate rate = {below(RATE_MOST + 1), 0};
        const int64_t from = rate.rate_q57;
        const int64_t target = below(RATE_MOST + 1);
        struct rate_ticks ticks;
        struct rate_move move = move_of(&b, &rate, target, &ticks);
        if (ticks.half > 5000) {
            continue;
        }
        if (i % 3 == 0) {
            rate_move_shorten(&move);
            TEST_ASSERT_TRUE(move.even <= move.rise);
        }
        run(&move, &rate, (uint64_t)below((int64_t)ticks.rise + ticks.half + 1));
        TEST_ASSERT_TRUE(target > from ? rate.rate_q57 >= from && rate.rate_q57 <= target
                                       : rate.rate_q57 <= from && rate.rate_q57 >= target);
    }
}

/* The least bounds that the format has, and the greatest. */
static void test_bounds_at_the_ends_of_the_format(void)
{
    for (uint32_t period_us = 1000; period_us <= 8000; period_us *= 2) {
        const struct bounds slow = make_bounds(1, 1, period_us);
        const struct bounds fast = make_bounds(UINT32_MAX, UINT32_MAX, period_us);
        struct rate rate = {RATE_MOST, 0};
        struct rate_ticks ticks;
        move_of(&slow, &rate, 0, &ticks);
        TEST_ASSERT_TRUE((double)ticks.rise + ticks.half <=
                         fewest(&slow, (double)RATE_MOST) * 1.002 + 4);
        struct rate_move move = move_of(&fast, &rate, 0, &ticks);
        TEST_ASSERT_TRUE(ticks.rise <= 3 && ticks.half <= 4);
        run(&move, &rate, UINT64_MAX);
    }
}

static void test_root_above(void)
{
    for (int i = 0; i < 1000000; i++) {
        const uint32_t a = (uint32_t)golden_random(&random_state) | 1u << 30;
        const double root = sqrt(a);
        const uint32_t above = qmath_root_above(a);
        TEST_ASSERT_TRUE(above >= root && above <= root * (1 + 1.0 / 1024) + 2);
    }
    TEST_ASSERT_TRUE(qmath_root_above(UINT32_MAX) >= 65536);
    TEST_ASSERT_TRUE(qmath_root_above(1u << 30) >= 32768);
}

/* Next to each square is where the estimate of the lower half is one too large. */
static void test_root_beside_squares(void)
{
    for (uint64_t upper = 0x8000u; upper <= 0xFFFFu; upper++) {
        const uint64_t lower[] = {0, 1, 0x7FFFu, 0xFFFDu, 0xFFFEu, 0xFFFFu};
        for (size_t i = 0; i < sizeof lower / sizeof lower[0]; i++) {
            const uint64_t root = upper << 16 | lower[i];
            TEST_ASSERT_EQUAL_UINT64(root, qmath_root(root * root));
            TEST_ASSERT_EQUAL_UINT64(root, qmath_root(root * root + 2u * root));
            TEST_ASSERT_EQUAL_UINT64(root - 1u, qmath_root(root * root - 1u));
        }
    }
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
    RUN_TEST(test_comes_to_the_target);
    RUN_TEST(test_a_cut_ends_where_it_said);
    RUN_TEST(test_bounds_at_the_ends_of_the_format);
    RUN_TEST(test_root_above);
    RUN_TEST(test_root);
    RUN_TEST(test_root_beside_squares);
    return UNITY_END();
}
