/* SPDX-License-Identifier: MIT */
/* Tests of core/override_ramp.h: ramps of the feed override from one constant value to another. Run by `make unit`;
 * no I/O. */
#include "core/override_ramp.h"

#include <math.h>
#include <string.h>

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
    struct ramp_limits limits;
    double slope;
    double second;
    uint32_t period_us;
};

static struct bounds make_bounds(uint8_t rate, uint8_t second, uint32_t period_log2)
{
    const uint32_t level = 3;
    struct program_override raw = {0};
    struct bounds b;
    b.period_us = 1000u << period_log2;
    const double h = b.period_us * 1e-6;
    raw.rate[level] = rate;
    raw.second[level] = second;
    override_limits_of(&b.limits, &raw, level, period_log2);
    b.slope = fmin(ldexp((double)program_number(rate), -32) * h, 1) * 72057594037927936.0;
    b.second = fmin(ldexp((double)program_number(second), -24) * h * h, 1) * 72057594037927936.0;
    return b;
}

static struct bounds random_bounds(void)
{
    const uint8_t rate = (uint8_t)(1 + below(255));
    const uint8_t second = (uint8_t)(1 + below(255));
    return make_bounds(rate, second, (uint32_t)below(4));
}

static struct override_ramp ramp_of(const struct bounds *b, const struct override_state *from,
                                    int64_t target, struct ramp_ticks *ticks)
{
    const int64_t change = target - from->override_q57;
    struct override_ramp ramp;
    override_ticks_of(ticks, &b->limits, change < 0 ? -change : change);
    int64_t step = override_step_of(ticks, change < 0 ? -change : change);
    TEST_ASSERT_TRUE((double)step * ticks->rise <= b->slope);
    TEST_ASSERT_TRUE((double)step <= b->second);
    override_ramp_begin(&ramp, from->override_q57, ticks, change < 0 ? -step : step);
    return ramp;
}

/* Runs it to its end, or to a cut after so many ticks: the slope changes by the step at most, never beyond what it
 * rises to, and it ends where the ramp computed. Gives the program time in ticks at override 1. */
static double run(struct override_ramp *ramp, struct override_state *rate, uint64_t cut)
{
    const int64_t step = ramp->step_q56;
    const int64_t most = step * (int64_t)ramp->rise;
    double time = 0;
    for (uint64_t n = 0; override_ramp_moves(ramp); n++) {
        const struct override_state before = *rate;
        if (n == cut) {
            override_ramp_cut(ramp);
        }
        override_tick(rate, override_ramp_slope(ramp, rate->slope_q56));
        const int64_t second = rate->slope_q56 - before.slope_q56;
        TEST_ASSERT_TRUE(rate->override_q57 - before.override_q57 ==
                         before.slope_q56 + rate->slope_q56);
        TEST_ASSERT_TRUE(second == 0 || second == step || second == -step);
        TEST_ASSERT_TRUE(step < 0 ? rate->slope_q56 <= 0 && rate->slope_q56 >= most
                                  : rate->slope_q56 >= 0 && rate->slope_q56 <= most);
        time += ((double)before.override_q57 * 3 + (double)before.slope_q56 * 2 +
                 (double)rate->slope_q56) /
                6 / 72057594037927936.0;
    }
    TEST_ASSERT_TRUE(rate->slope_q56 == 0);
    TEST_ASSERT_TRUE(rate->override_q57 == ramp->end_q57);
    return time;
}

/* Ticks of the continuous change: with the slope rising to its bound, or not. */
static double fewest(const struct bounds *b, double change)
{
    const double peak = sqrt(change / 2 * b->second);
    return peak <= b->slope ? 2 * sqrt(change / 2 / b->second)
                            : change / 2 / b->slope + b->slope / b->second;
}

static void test_comes_to_the_target(void)
{
    for (int i = 0; i < 20000; i++) {
        const struct bounds b = random_bounds();
        struct override_state rate = {below(OVERRIDE_MOST + 1), 0};
        const int64_t from = rate.override_q57;
        const int64_t target = i % 4 == 0   ? 0
                               : i % 4 == 1 ? OVERRIDE_ONE
                                            : below(OVERRIDE_MOST >> below(40));
        const double change = fabs((double)(target - from));
        struct ramp_ticks ticks;
        struct override_ramp ramp = ramp_of(&b, &rate, target, &ticks);
        const double total = (double)ticks.rise + ticks.half;
        TEST_ASSERT_TRUE(total <= fewest(&b, change) * 1.002 + 4);
        if (total > 10000) {
            continue; /* too long to run */
        }
        const double time = run(&ramp, &rate, UINT64_MAX);
        const int64_t left =
            target > from ? target - rate.override_q57 : rate.override_q57 - target;
        TEST_ASSERT_TRUE(left >= 0 && left < 2 * (int64_t)ticks.rise * ticks.half);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 1e-12 * total,
                                  total * (double)(from + rate.override_q57) / 2 / OVERRIDE_ONE,
                                  time);
        const uint32_t period_q32_s = (uint32_t)(b.period_us * 4294.967296) + 1u;
        const uint64_t span =
            override_span_q32(&ticks, (from + rate.override_q57) / 2, period_q32_s);
        TEST_ASSERT_TRUE(time * b.period_us * 4294.967296 <= (double)span);
    }
}

/* A fall that ends early may last longer in program time than the whole one, by an eighth at most. */
static void test_a_cut_ends_where_and_when_it_said(void)
{
    for (int i = 0; i < 20000; i++) {
        const struct bounds b = random_bounds();
        struct override_state rate = {below(OVERRIDE_MOST + 1), 0};
        const int64_t from = rate.override_q57;
        const int64_t target = below(OVERRIDE_MOST + 1);
        struct ramp_ticks ticks;
        struct override_ramp ramp = ramp_of(&b, &rate, target, &ticks);
        if (ticks.half > 5000) {
            continue;
        }
        if (i % 3 == 0) {
            override_ramp_shorten(&ramp);
            TEST_ASSERT_TRUE(ramp.even <= 2u * ramp.rise + 40u);
        }
        const double time =
            run(&ramp, &rate, (uint64_t)below((int64_t)ticks.rise + ticks.half + 1));
        const uint32_t period_q32_s = (uint32_t)(b.period_us * 4294.967296) + 1u;
        const uint64_t span = override_span_q32(&ticks, (from + target) / 2, period_q32_s);
        TEST_ASSERT_TRUE(time * b.period_us * 4294.967296 <=
                         (double)(span + (target < from ? span >> 3 : 0u)));
        TEST_ASSERT_TRUE(target > from ? rate.override_q57 >= from && rate.override_q57 <= target
                                       : rate.override_q57 <= from && rate.override_q57 >= target);
    }
}

/* The least bounds that the format has, and the greatest. */
static void test_bounds_at_the_ends_of_the_format(void)
{
    for (uint32_t period_log2 = 0; period_log2 < 4; period_log2++) {
        const struct bounds slow = make_bounds(1, 1, period_log2);
        const struct bounds fast = make_bounds(255, 255, period_log2);
        struct override_state rate = {OVERRIDE_MOST, 0};
        struct ramp_ticks ticks;
        ramp_of(&slow, &rate, 0, &ticks);
        TEST_ASSERT_TRUE((double)ticks.rise + ticks.half <=
                         fewest(&slow, (double)OVERRIDE_MOST) * 1.002 + 4);
        struct override_ramp ramp = ramp_of(&fast, &rate, 0, &ticks);
        TEST_ASSERT_TRUE(ticks.rise <= 3 && ticks.half <= 4);
        run(&ramp, &rate, UINT64_MAX);
    }
}

/* All codes: never above R and S, and no more than a rounding below; the last ones stand for a whole change in a
 * tick. */
static void test_limits_of_all_codes(void)
{
    for (uint32_t period_log2 = 0; period_log2 < 4; period_log2++) {
        for (int rate = 1; rate < 256; rate++) {
            for (int second = 1; second < 256; second++) {
                const struct bounds b = make_bounds((uint8_t)rate, (uint8_t)second, period_log2);
                const double slope = ldexp(1, 61) / b.limits.inverse_slope;
                const double root = ldexp(1, 45) / b.limits.inverse_root;
                TEST_ASSERT_TRUE(slope <= b.slope && root * root <= b.second);
                TEST_ASSERT_TRUE(slope >= b.slope * 0.8 && root * root >= b.second * 0.8);
                const double rate_ticks =
                    fmin(b.slope, ldexp(1, 56)) / fmin(b.second, ldexp(1, 56));
                TEST_ASSERT_TRUE(b.limits.rate_ticks >= rate_ticks * 0.9);
                TEST_ASSERT_TRUE(b.limits.rate_ticks <= rate_ticks * 1.25 + 2);
            }
        }
    }
}

static struct program_override random_levels(void)
{
    struct program_override out = {.factor_q14 = 1u << 14};
    const uint8_t spread = (uint8_t)(1 + below(60));
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        out.rate[k] = (uint8_t)(100 + below(spread));
        out.second[k] = (uint8_t)(100 + below(spread));
    }
    return out;
}

static double level_rate(uint32_t level)
{
    return level == PROGRAM_LEVEL_FULL ? 2.0 : program_level_q9(level) / 512.0;
}

static void stage_of(struct ramp_stage *out, const struct program_override *bounds,
                     int64_t from_q57, int64_t to_q57)
{
    struct ramp_change change;
    override_change_of(&change, from_q57, to_q57);
    override_stage_of(out, bounds, &change);
}

/* Each stage goes towards the end, within the level whose bounds it takes, and few of them come there. */
static void test_stages(void)
{
    for (int i = 0; i < 100000; i++) {
        const struct program_override bounds = random_levels();
        const int64_t to = i % 5 == 0 ? 0 : i % 5 == 1 ? OVERRIDE_ONE : below(OVERRIDE_ONE + 1);
        int64_t at = i % 7 == 0 ? 0 : i % 7 == 1 ? OVERRIDE_ONE : below(OVERRIDE_ONE + 1);
        uint32_t stages = 0;
        while (at != to) {
            struct ramp_stage stage;
            stage_of(&stage, &bounds, at, to);
            TEST_ASSERT_TRUE(at < to ? stage.end_q57 > at && stage.end_q57 <= to
                                     : stage.end_q57 < at && stage.end_q57 >= to);
            TEST_ASSERT_TRUE(stage.end_q57 == to || stage.end_q57 < OVERRIDE_ONE);
            const int64_t most = stage.end_q57 > at ? stage.end_q57 : at;
            TEST_ASSERT_TRUE((double)most / (double)OVERRIDE_ONE <= level_rate(stage.level));
            at = stage.end_q57;
            TEST_ASSERT_TRUE(++stages <= PROGRAM_LEVELS);
        }
    }
}

/* A ramp does not end between two levels if that would gain nothing. */
static void test_levels_that_are_alike_are_one(void)
{
    struct program_override bounds = {.factor_q14 = 1u << 14};
    struct ramp_stage stage;
    memset(bounds.rate, 150, sizeof bounds.rate);
    memset(bounds.second, 120, sizeof bounds.second);
    stage_of(&stage, &bounds, 0, OVERRIDE_ONE);
    TEST_ASSERT_EQUAL_INT64(OVERRIDE_ONE, stage.end_q57);
    TEST_ASSERT_EQUAL_UINT32(PROGRAM_LEVEL_FULL, stage.level);
    stage_of(&stage, &bounds, OVERRIDE_ONE, 0);
    TEST_ASSERT_EQUAL_INT64(0, stage.end_q57);
    bounds.rate[PROGRAM_LEVEL_FULL] = 100;
    stage_of(&stage, &bounds, 0, OVERRIDE_ONE);
    TEST_ASSERT_EQUAL_INT64((int64_t)511 << 48, stage.end_q57);
    TEST_ASSERT_EQUAL_UINT32(PROGRAM_LEVEL_FULL - 1u, stage.level);
    stage_of(&stage, &bounds, OVERRIDE_ONE, 0);
    TEST_ASSERT_EQUAL_INT64(((int64_t)511 << 48) - OVERRIDE_SPARE, stage.end_q57);
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
    RUN_TEST(test_a_cut_ends_where_and_when_it_said);
    RUN_TEST(test_bounds_at_the_ends_of_the_format);
    RUN_TEST(test_limits_of_all_codes);
    RUN_TEST(test_stages);
    RUN_TEST(test_levels_that_are_alike_are_one);
    RUN_TEST(test_root_above);
    RUN_TEST(test_root);
    RUN_TEST(test_root_beside_squares);
    return UNITY_END();
}
