/* SPDX-License-Identifier: MIT */
/* Bounds of feed, acceleration and jerk against values sampled in double, for every piece of golden programs. Run by
 * `make unit`; reads files of tests/data. */
#include "core/bernstein.h"
#include "core/feed_bounds.h"

#include <math.h>

#include "golden.h"
#include "unity.h"

#define SAMPLES 2000

static const char *const names[] = {"alpha_quintic.hdgp", "alpha_exponential.hdgp",
                                    "heart_minimax.hdgp", "line_tiny.hdgp", "line_slow.hdgp"};

void setUp(void)
{
}

void tearDown(void)
{
}

/* Derivative of F at t seconds into a piece, per second^order. */
static double derivative(const struct program_piece *c, int order, double t)
{
    double scale = ldexp(1.0, -program_piece_exponent(c->duration_q32_s));
    double sum = 0;
    for (int k = 7; k >= order; k--) {
        double factor = 1;
        for (int i = 0; i < order; i++) {
            factor *= k - i;
        }
        sum = sum * t * scale + factor * ldexp((double)c->c_q40_mm[k - 1], -40);
    }
    return sum * pow(scale, order);
}

static void check_piece(const struct program_piece *c, int order, const char *name)
{
    double duration = ldexp((double)c->duration_q32_s, -32);
    double low = HUGE_VAL;
    double high = -HUGE_VAL;
    for (int i = 0; i <= SAMPLES; i++) {
        double value = derivative(c, order, duration * i / SAMPLES);
        low = value < low ? value : low;
        high = value > high ? value : high;
    }
    double slack = 0.005 * (fabs(low) > fabs(high) ? fabs(low) : fabs(high)) + 1e-3;
    int64_t low_q24 = (int64_t)ldexp(low - slack, 24);
    int64_t high_q24 = (int64_t)ldexp(high + slack, 24);
    int64_t slack_q24 = (int64_t)ldexp(2 * slack, 24);
    enum feed_derivative d = (enum feed_derivative)order;
    TEST_ASSERT_TRUE_MESSAGE(feed_bounds_within(c, d, low_q24, high_q24), name);
    TEST_ASSERT_FALSE_MESSAGE(feed_bounds_within(c, d, low_q24 + slack_q24, high_q24), name);
    TEST_ASSERT_FALSE_MESSAGE(feed_bounds_within(c, d, low_q24, high_q24 - slack_q24), name);
}

static void test_bounds_are_tight_to_half_a_percent(void)
{
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct program p;
        struct program_piece c;
        golden_open(&p, names[i]);
        for (uint32_t k = 0; k < p.header.piece_count; k++) {
            program_piece_get(&p, k, &c);
            for (int order = 1; order <= 3; order++) {
                check_piece(&c, order, names[i]);
            }
        }
        golden_close(&p);
    }
}

static void test_ends(void)
{
    struct program p;
    struct program_piece c;
    struct feed_state start;
    struct feed_state end;
    golden_open(&p, "alpha_exponential.hdgp");
    for (uint32_t k = 0; k < p.header.piece_count; k++) {
        program_piece_get(&p, k, &c);
        double duration = ldexp((double)c.duration_q32_s, -32);
        feed_bounds_start(&c, &start);
        feed_bounds_end(&c, &end);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, derivative(&c, 1, 0),
                                  ldexp((double)start.feed_q24_mm_s, -24));
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, derivative(&c, 1, duration),
                                  ldexp((double)end.feed_q24_mm_s, -24));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, derivative(&c, 2, 0),
                                  ldexp((double)start.acceleration_q16_mm_s2, -16));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, derivative(&c, 2, duration),
                                  ldexp((double)end.acceleration_q16_mm_s2, -16));
    }
    golden_close(&p);
}

/* The shortest and the longest piece: no shift leaves its range, and nonsense is refused. */
static void test_extreme_durations(void)
{
    const uint64_t durations[] = {1, 2, 3, (uint64_t)1 << 32, (uint64_t)1 << 54};
    const int64_t most = (int64_t)1 << 54;
    for (int i = 0; i < 5; i++) {
        struct program_piece c = {.duration_q32_s = durations[i],
                                  .c_q40_mm = {most, -most, most, -most, most, -most, most}};
        struct feed_state s;
        feed_bounds_end(&c, &s);
        feed_bounds_start(&c, &s);
        for (int order = 1; order <= 3; order++) {
            TEST_ASSERT_FALSE(feed_bounds_within(&c, (enum feed_derivative)order, 0, 0));
            c.c_q40_mm[6] = -most;
        }
    }
}

static void test_a_piece_stays_between_its_ends(void)
{
    struct program_piece c = {.duration_q32_s = UINT64_C(64) << 32};
    TEST_ASSERT_TRUE(feed_bounds_contained(&c));
    c.c_q40_mm[0] = INT64_C(32) << 40;
    TEST_ASSERT_TRUE(feed_bounds_contained(&c));
    c.c_q40_mm[0] = -(INT64_C(32) << 40); /* backwards is somebody else's concern */
    TEST_ASSERT_TRUE(feed_bounds_contained(&c));
    for (int64_t slack_q40 = 1 << 24; slack_q40 <= 1 << 28; slack_q40 *= 2) {
        /* 4 s (tau^2 - tau): back by s, and there again */
        c.c_q40_mm[0] = -4 * slack_q40;
        c.c_q40_mm[1] = 4 * slack_q40;
        TEST_ASSERT_EQUAL_INT(slack_q40 <= 1 << 26, feed_bounds_contained(&c));
        /* the same beyond an end at 8 mm */
        c.c_q40_mm[0] = (INT64_C(8) << 40) + 4 * slack_q40;
        c.c_q40_mm[1] = -4 * slack_q40;
        TEST_ASSERT_TRUE_MESSAGE(feed_bounds_contained(&c), "never at rest: not beyond");
    }
}

/* With the largest coefficients nothing leaves 64 bits (checked by the sanitizer). */
static void test_the_distance_of_extreme_coefficients(void)
{
    struct program_piece c = {.duration_q32_s = UINT64_C(1) << 32};
    for (int k = 0; k < 7; k++) {
        c.c_q40_mm[k] = (k < 3 ? -1 : 1) * (INT64_C(1) << 54);
    }
    TEST_ASSERT_FALSE(feed_bounds_contained(&c));
    for (int k = 0; k < 7; k++) {
        c.c_q40_mm[k] = INT64_C(1) << 54;
    }
    TEST_ASSERT_TRUE(feed_bounds_contained(&c));
}

/* A touch of the bound from below that halving never decides: refused at the greatest depth, wherever it is. */
static void test_what_cannot_be_decided_is_refused(void)
{
    static const int64_t high = INT64_C(1) << 40;
    for (int k = 0; k <= 1024; k += 31) {
        const double at = (k + 1.0 / 3.0) / 1025.0;
        const double powers[3] = {-at * at, 2.0 * at, -1.0}; /* -(tau - at)^2 */
        int64_t b[5];
        for (int i = 0; i <= 4; i++) {
            const double value = powers[0] + powers[1] * i / 4.0 + powers[2] * i * (i - 1) / 12.0;
            b[i] = high + (int64_t)(value * 1099511627776.0);
        }
        TEST_ASSERT_TRUE(bernstein_within(b, 4, -high * 4, high + (high >> 12)));
        TEST_ASSERT_FALSE(bernstein_within(b, 4, -high * 4, high - 1000));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bounds_are_tight_to_half_a_percent);
    RUN_TEST(test_ends);
    RUN_TEST(test_extreme_durations);
    RUN_TEST(test_a_piece_stays_between_its_ends);
    RUN_TEST(test_the_distance_of_extreme_coefficients);
    RUN_TEST(test_what_cannot_be_decided_is_refused);
    return UNITY_END();
}
