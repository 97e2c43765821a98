/* SPDX-License-Identifier: MIT */
/* Tests of core/override_plan.h: which override ramp comes next towards the commanded override, and a tick of it.
 * Run by `make unit`; reads files of tests/data. */
#include "core/override_plan.h"

#include <string.h>

#include "golden.h"
#include "unity.h"

static struct program p;
static struct golden_precomputed precomputed; /* the same with coefficient records */
static struct program_clock clock;
static struct override_plan plan;

void setUp(void)
{
    golden_open(&p, "alpha_minimax.hdgp");
}

void tearDown(void)
{
    golden_discard(&precomputed);
    golden_close(&p);
}

static void begin_at(uint32_t period_us, uint64_t time_q42_s)
{
    golden_discard(&precomputed);
    golden_precompute(&precomputed, &p, KERNEL_FIXED);
    program_clock_begin(&clock, &precomputed.program, period_us, time_q42_s);
    override_plan_begin(&plan, &precomputed.program);
}

static uint64_t step(void)
{
    return override_plan_tick(&plan, &clock);
}

static uint64_t time_q42(void)
{
    return program_clock_time_q42(&clock);
}

static int ended(void)
{
    return clock.time_q42_s == p.header.duration_q32_s << 10;
}

static uint32_t override_q30(void)
{
    return (uint32_t)(plan.now.override_q57 >> 27);
}

/* floor(k period_us 2^bits / 10^6 + 1/2), for products below 2^64 */
static uint64_t exact_tick(uint64_t k, uint64_t period_us, int bits)
{
    uint64_t us = k * period_us;
    uint64_t whole = us / 1000000u;
    uint64_t rest = us % 1000000u;
    return (whole << bits) + ((rest << bits) + 500000u) / 1000000u;
}

static void test_ticks_are_exact(void)
{
    const uint32_t periods[] = {1000, 2000, 4000, 8000};
    for (int i = 0; i < 4; i++) {
        begin_at(periods[i], 0);
        for (uint32_t k = 0; k + 1u < p.header.duration_q32_s * 1000000u / periods[i] >> 32; k++) {
            TEST_ASSERT_EQUAL_UINT64(exact_tick(k, periods[i], 42), step());
            TEST_ASSERT_EQUAL_UINT64(exact_tick(k, periods[i], 42), time_q42());
        }
        while (!ended()) {
            (void)step();
        }
        TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, time_q42());
    }
}

static void test_ends_with_the_last_tick(void)
{
    begin_at(1000, 0);
    for (uint32_t k = 1; k < program_ticks(&p); k++) {
        (void)step();
        TEST_ASSERT_FALSE(ended());
    }
    for (int again = 0; again < 3; again++) {
        TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, step());
        TEST_ASSERT_TRUE(ended());
        override_plan_hold(&plan);
    }
}

static void tightest(double *rate, double *second)
{
    struct program_piece piece;
    *rate = *second = 1e30;
    for (uint32_t i = 0; i < p.header.piece_count; i++) {
        program_piece_get(&p, i, &piece);
        double r = (double)program_number(piece.override.rate[0]) / 4294967296.0;
        double s = (double)program_number(piece.override.second[0]) / 16777216.0;
        *rate = r < *rate ? r : *rate;
        *second = s < *second ? s : *second;
    }
}

/* Mean rates per tick are within the bounds of the rate's derivatives, as its mean values must be. */
static void check_hold(uint32_t at, uint32_t period_us)
{
    double rate_limit = 0;
    double second_limit = 0;
    double h = period_us * 1e-6;
    double rate[3] = {1, 1, 1};
    tightest(&rate_limit, &second_limit);
    begin_at(period_us, 0);
    for (uint32_t k = 0; k <= at; k++) {
        (void)step();
    }
    override_plan_hold(&plan);
    for (int rest = 3; rest > 0;) {
        uint64_t before = time_q42();
        (void)step();
        if (ended()) {
            return;
        }
        rate[2] = rate[1];
        rate[1] = rate[0];
        rate[0] = (double)(time_q42() - before) / 4398046511104.0 / h;
        TEST_ASSERT_TRUE(override_q30() / 1073741824.0 <= rate[0] + 1e-8);
        TEST_ASSERT_TRUE(rate[0] <= rate[1] + 1e-8);
        TEST_ASSERT_TRUE(rate[1] - rate[0] <= rate_limit * h + 1e-8);
        double second = rate[0] - 2 * rate[1] + rate[2];
        TEST_ASSERT_TRUE((second < 0 ? -second : second) <= second_limit * h * h + 1e-8);
        rest -= override_q30() == 0;
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, rate[0]);
}

/* In all levels. */
static void set_override(uint8_t rate, uint8_t second)
{
    uint8_t *image = (uint8_t *)(uintptr_t)p.image;
    for (uint32_t i = 0; i < p.header.piece_count; i++) {
        uint8_t *piece = image + PROGRAM_HEADER_SIZE +
                         (size_t)p.header.segment_count * PROGRAM_SEGMENT_SIZE +
                         (size_t)i * PROGRAM_PIECE_SIZE;
        memset(piece + 74, rate, PROGRAM_LEVELS);
        memset(piece + 74 + PROGRAM_LEVELS, second, PROGRAM_LEVELS);
    }
}

static void test_hold_keeps_the_bounds(void)
{
    const uint32_t periods[] = {1000, 2000, 4000, 8000};
    set_override(159, 133); /* 14.67 /s, 394 /s^2 */
    for (int i = 0; i < 4; i++) {
        for (uint32_t at = 0; at < 900; at += 37) {
            check_hold(at, periods[i]);
        }
    }
}

static void test_hold_for_any_bounds(void)
{
    uint64_t random = 3;
    for (int i = 0; i < 300; i++) {
        uint8_t rate = (uint8_t)(1u + golden_random(&random) % 255u);
        uint8_t second = (uint8_t)(1u + golden_random(&random) % 255u);
        set_override(rate, second);
        check_hold((uint32_t)(golden_random(&random) % 300u), 1000u << (i % 4));
    }
}

static void test_hold_as_slow_as_can_be_ends_with_the_program(void)
{
    set_override(1, 1);
    begin_at(1000, 0);
    (void)step();
    override_plan_hold(&plan);
    for (uint32_t k = 1; k < program_ticks(&p) + 2u; k++) {
        (void)step();
    }
    TEST_ASSERT_TRUE(ended());
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, time_q42());
}

static void steps(int n)
{
    for (int i = 0; i < n; i++) {
        (void)step();
    }
}

static void to_rest(void)
{
    for (int n = 0; (plan.now.override_q57 | plan.now.slope_q56) != 0; n++) {
        TEST_ASSERT_TRUE(n < 100000);
        (void)step();
    }
}

static void to_end(void)
{
    for (int n = 0; !ended(); n++) {
        TEST_ASSERT_TRUE(n < 100000);
        (void)step();
    }
}

static void test_hold_and_release(void)
{
    begin_at(1000, 0);
    steps(400);
    override_plan_hold(&plan);
    uint32_t last = override_q30();
    while (override_q30() != 0) {
        (void)step();
        TEST_ASSERT_TRUE(override_q30() <= last);
        last = override_q30();
    }
    uint64_t time = time_q42();
    steps(1000);
    TEST_ASSERT_EQUAL_UINT64(time, time_q42());
    override_plan_release(&plan);
    while (override_q30() != 1u << 30) {
        (void)step();
        TEST_ASSERT_FALSE(ended());
        TEST_ASSERT_TRUE(override_q30() >= last && override_q30() <= 1u << 30);
        last = override_q30();
    }
    (void)step(); /* the override may have been a unit away */
    time = time_q42();
    steps(125); /* 125 ms are an eighth of a second: no rounding */
    TEST_ASSERT_EQUAL_UINT64(time + (UINT64_C(1) << 39), time_q42());
}

/* A command while held is kept for the release. */
static void test_commands_while_held(void)
{
    begin_at(1000, 0);
    steps(300);
    override_plan_hold(&plan);
    to_rest();
    override_plan_set(&plan, 50);
    uint64_t time = time_q42();
    steps(10);
    TEST_ASSERT_EQUAL_UINT64(time, time_q42());
    override_plan_release(&plan);
    for (int n = 0; override_q30() != 1u << 29; n++) {
        TEST_ASSERT_TRUE(n < 100000 && override_q30() <= 1u << 29);
        (void)step();
    }
}

/* A path stop has ended: the override rises from 0 there. */
static void test_rest(void)
{
    begin_at(1000, 0);
    steps(300);
    program_clock_set(&clock, clock.time_q42_s, clock.piece, clock.record);
    override_plan_restart(&plan);
    TEST_ASSERT_EQUAL_UINT32(0, override_q30());
    (void)step();
    TEST_ASSERT_TRUE(override_q30() < 1u << 30);
    to_end();
}

/* At the start the path is at rest, so the override is there at once; a hold before the first tick holds. */
static void test_before_the_first_tick(void)
{
    begin_at(1000, 0);
    override_plan_set(&plan, 40);
    TEST_ASSERT_EQUAL_UINT64(0, step());
    (void)step();
    TEST_ASSERT_UINT64_WITHIN(1, (uint64_t)(0.4e-3 * 4294967296.0), step() >> 11);
    begin_at(1000, 0);
    override_plan_hold(&plan);
    TEST_ASSERT_EQUAL_UINT64(0, step());
    steps(10);
    TEST_ASSERT_EQUAL_UINT64(0, time_q42());
    override_plan_release(&plan);
    to_end();
}

static void test_override(void)
{
    set_override(159, 133); /* 14.67 /s, 394 /s^2 */
    begin_at(1000, 0);
    steps(300);
    override_plan_set(&plan, 0);
    steps(300);
    TEST_ASSERT_FALSE(ended());
    TEST_ASSERT_EQUAL_UINT32(0, override_q30());
    override_plan_set(&plan, 50);
    steps(300);
    TEST_ASSERT_EQUAL_UINT32(1u << 29, override_q30());
    TEST_ASSERT_EQUAL_INT(0, plan.saturated);
}

static void set_factor(uint32_t first, uint32_t behind, uint32_t factor_q14)
{
    uint8_t *image = (uint8_t *)(uintptr_t)p.image;
    for (uint32_t i = first; i < behind; i++) {
        uint8_t *piece = image + PROGRAM_HEADER_SIZE +
                         (size_t)p.header.segment_count * PROGRAM_SEGMENT_SIZE +
                         (size_t)i * PROGRAM_PIECE_SIZE;
        piece[72] = (uint8_t)factor_q14;
        piece[73] = (uint8_t)(factor_q14 >> 8);
    }
}

/* Up to the factor if the return ramp fits, down again before a piece that allows less. */
static void test_override_saturates(void)
{
    uint32_t most = 0;
    uint32_t last = 0;
    set_override(159, 133);                                              /* 14.67 /s, 394 /s^2 */
    set_factor(0, p.header.piece_count, (1u << 14) + (1u << 12));        /* 1.25 */
    set_factor(10, p.header.piece_count - 10u, (1u << 14) + (1u << 13)); /* 1.5 */
    begin_at(1000, 0);
    override_plan_set(&plan, 999);
    for (uint32_t k = 0; !ended(); k++) {
        (void)step();
        last = override_q30() != 0 ? override_q30() : last;
        most = last > most ? last : most;
        TEST_ASSERT_TRUE(k < 2 || plan.saturated || override_q30() == 0);
    }
    TEST_ASSERT_UINT32_WITHIN(1, 3u << 29, most);
    TEST_ASSERT_UINT32_WITHIN(1, 5u << 28, last);
}

static void test_start_from_a_position(void)
{
    begin_at(1000, UINT64_C(1) << 41);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 41, step());
    TEST_ASSERT_EQUAL_UINT32(0, override_q30());
    TEST_ASSERT_FALSE(ended());
    to_end();
    begin_at(1000, UINT64_MAX);
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, step());
    TEST_ASSERT_TRUE(ended());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_ticks_are_exact);
    RUN_TEST(test_ends_with_the_last_tick);
    RUN_TEST(test_hold_keeps_the_bounds);
    RUN_TEST(test_hold_for_any_bounds);
    RUN_TEST(test_hold_as_slow_as_can_be_ends_with_the_program);
    RUN_TEST(test_hold_and_release);
    RUN_TEST(test_commands_while_held);
    RUN_TEST(test_rest);
    RUN_TEST(test_before_the_first_tick);
    RUN_TEST(test_override);
    RUN_TEST(test_override_saturates);
    RUN_TEST(test_start_from_a_position);
    return UNITY_END();
}
