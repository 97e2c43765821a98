/* SPDX-License-Identifier: MIT */
#include "core/timebase.h"

#include <string.h>

#include "golden.h"
#include "unity.h"

static struct program p;
static struct timebase tb;

void setUp(void)
{
    golden_open(&p, "alpha_minimax.hdgp");
}

void tearDown(void)
{
    golden_close(&p);
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
        timebase_begin(&tb, &p, periods[i]);
        for (uint32_t k = 0; timebase_state(&tb) == TIMEBASE_RUNNING; k++) {
            uint64_t time = timebase_step(&tb);
            if (timebase_state(&tb) == TIMEBASE_RUNNING) {
                TEST_ASSERT_EQUAL_UINT64(exact_tick(k, periods[i], 32), time);
                TEST_ASSERT_EQUAL_UINT64(exact_tick(k, periods[i], 42), timebase_time_q42(&tb));
            }
        }
        TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, timebase_time_q42(&tb));
    }
}

static void test_ends_with_the_last_tick(void)
{
    timebase_begin(&tb, &p, 1000);
    for (uint32_t k = 1; k < program_ticks(&p); k++) {
        timebase_step(&tb);
        TEST_ASSERT_EQUAL_INT(TIMEBASE_RUNNING, timebase_state(&tb));
    }
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s, timebase_step(&tb));
    TEST_ASSERT_EQUAL_INT(TIMEBASE_ENDED, timebase_state(&tb));
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s, timebase_step(&tb));
    timebase_stop(&tb);
    TEST_ASSERT_EQUAL_INT(TIMEBASE_ENDED, timebase_state(&tb));
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
static void check_stop(uint32_t at, uint32_t period_us)
{
    double rate_limit = 0;
    double second_limit = 0;
    double h = period_us * 1e-6;
    double rate[3] = {1, 1, 1};
    tightest(&rate_limit, &second_limit);
    timebase_begin(&tb, &p, period_us);
    for (uint32_t k = 0; k <= at; k++) {
        timebase_step(&tb);
    }
    timebase_stop(&tb);
    for (int rest = 3; rest > 0;) {
        uint64_t before = timebase_time_q42(&tb);
        timebase_step(&tb);
        if (timebase_state(&tb) == TIMEBASE_ENDED) {
            return;
        }
        rate[2] = rate[1];
        rate[1] = rate[0];
        rate[0] = (double)(timebase_time_q42(&tb) - before) / 4398046511104.0 / h;
        TEST_ASSERT_TRUE(timebase_rate_q30(&tb) / 1073741824.0 <= rate[0] + 1e-8);
        TEST_ASSERT_TRUE(rate[0] <= rate[1] + 1e-8);
        TEST_ASSERT_TRUE(rate[1] - rate[0] <= rate_limit * h + 1e-8);
        double second = rate[0] - 2 * rate[1] + rate[2];
        TEST_ASSERT_TRUE((second < 0 ? -second : second) <= second_limit * h * h + 1e-8);
        rest -= timebase_state(&tb) == TIMEBASE_STOPPED;
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

static void test_stop_keeps_the_bounds(void)
{
    const uint32_t periods[] = {1000, 2000, 4000, 8000};
    set_override(159, 133); /* 14.67 /s, 394 /s^2 */
    for (int i = 0; i < 4; i++) {
        for (uint32_t at = 0; at < 900; at += 37) {
            check_stop(at, periods[i]);
        }
    }
}

static void test_stop_for_any_bounds(void)
{
    uint64_t random = 3;
    for (int i = 0; i < 300; i++) {
        uint8_t rate = (uint8_t)(1u + golden_random(&random) % 255u);
        uint8_t second = (uint8_t)(1u + golden_random(&random) % 255u);
        set_override(rate, second);
        check_stop((uint32_t)(golden_random(&random) % 300u), 1000u << (i % 4));
    }
}

static void test_stop_as_slow_as_can_be_ends_with_the_program(void)
{
    set_override(1, 1);
    timebase_begin(&tb, &p, 1000);
    timebase_step(&tb);
    timebase_stop(&tb);
    for (uint32_t k = 1; k < program_ticks(&p) + 2u; k++) {
        timebase_step(&tb);
    }
    TEST_ASSERT_EQUAL_INT(TIMEBASE_ENDED, timebase_state(&tb));
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s << 10, timebase_time_q42(&tb));
}

static void steps(int n)
{
    for (int i = 0; i < n; i++) {
        timebase_step(&tb);
    }
}

static int steps_to(enum timebase_state state)
{
    int n = 0;
    for (; timebase_state(&tb) != state; n++) {
        TEST_ASSERT_TRUE(n < 100000);
        timebase_step(&tb);
    }
    return n;
}

static void test_hold_and_resume(void)
{
    timebase_begin(&tb, &p, 1000);
    steps(400);
    timebase_hold(&tb);
    TEST_ASSERT_EQUAL_INT(TIMEBASE_HOLDING, timebase_state(&tb));
    uint32_t rate = timebase_rate_q30(&tb);
    while (timebase_state(&tb) == TIMEBASE_HOLDING) {
        timebase_step(&tb);
        TEST_ASSERT_TRUE(timebase_rate_q30(&tb) <= rate);
        rate = timebase_rate_q30(&tb);
    }
    TEST_ASSERT_EQUAL_INT(TIMEBASE_HELD, timebase_state(&tb));
    TEST_ASSERT_EQUAL_UINT32(0, rate);
    uint64_t time = timebase_time_q42(&tb);
    steps(1000);
    TEST_ASSERT_EQUAL_UINT64(time, timebase_time_q42(&tb));
    timebase_resume(&tb);
    while (timebase_rate_q30(&tb) != 1u << 30) {
        timebase_step(&tb);
        TEST_ASSERT_EQUAL_INT(TIMEBASE_RUNNING, timebase_state(&tb));
        TEST_ASSERT_TRUE(timebase_rate_q30(&tb) >= rate && timebase_rate_q30(&tb) <= 1u << 30);
        rate = timebase_rate_q30(&tb);
    }
    timebase_step(&tb); /* the rate may have been a unit away */
    time = timebase_time_q42(&tb);
    steps(125); /* 125 ms are an eighth of a second: no rounding */
    TEST_ASSERT_EQUAL_UINT64(time + (UINT64_C(1) << 39), timebase_time_q42(&tb));
}

static void test_stop_is_final(void)
{
    timebase_begin(&tb, &p, 1000);
    steps(300);
    timebase_hold(&tb);
    steps(3);
    timebase_stop(&tb);
    timebase_hold(&tb);
    timebase_resume(&tb);
    TEST_ASSERT_EQUAL_INT(TIMEBASE_STOPPING, timebase_state(&tb));
    steps_to(TIMEBASE_STOPPED);
    timebase_resume(&tb);
    timebase_override(&tb, 200);
    uint64_t time = timebase_time_q42(&tb);
    steps(10);
    TEST_ASSERT_EQUAL_UINT64(time, timebase_time_q42(&tb));
    TEST_ASSERT_EQUAL_INT(TIMEBASE_STOPPED, timebase_state(&tb));
}

static void test_stop_of_a_held_one(void)
{
    timebase_begin(&tb, &p, 1000);
    steps(300);
    timebase_hold(&tb);
    steps_to(TIMEBASE_HELD);
    timebase_stop(&tb);
    TEST_ASSERT_EQUAL_INT(TIMEBASE_STOPPED, timebase_state(&tb));
}

/* At the start the path is at rest, so the rate is there at once; a hold before the first tick holds. */
static void test_before_the_first_tick(void)
{
    timebase_begin(&tb, &p, 1000);
    timebase_override(&tb, 40);
    TEST_ASSERT_EQUAL_UINT64(0, timebase_step(&tb));
    timebase_step(&tb);
    TEST_ASSERT_UINT64_WITHIN(1, (uint64_t)(0.4e-3 * 4294967296.0), timebase_step(&tb) / 2u);
    timebase_begin(&tb, &p, 1000);
    timebase_hold(&tb);
    TEST_ASSERT_EQUAL_UINT64(0, timebase_step(&tb));
    TEST_ASSERT_EQUAL_INT(TIMEBASE_HELD, timebase_state(&tb));
    timebase_resume(&tb);
    steps_to(TIMEBASE_ENDED);
}

static void test_override(void)
{
    set_override(159, 133); /* 14.67 /s, 394 /s^2 */
    timebase_begin(&tb, &p, 1000);
    steps(300);
    timebase_override(&tb, 0);
    steps(300);
    TEST_ASSERT_EQUAL_INT(TIMEBASE_RUNNING, timebase_state(&tb));
    TEST_ASSERT_EQUAL_UINT32(0, timebase_rate_q30(&tb));
    timebase_override(&tb, 50);
    steps(300);
    TEST_ASSERT_EQUAL_UINT32(1u << 29, timebase_rate_q30(&tb));
    TEST_ASSERT_EQUAL_INT(0, timebase_saturated(&tb));
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

/* Up to the factor where there is room for the way back, down again before a piece that allows less. */
static void test_override_saturates(void)
{
    uint32_t most = 0;
    uint32_t last = 0;
    set_override(159, 133);                                              /* 14.67 /s, 394 /s^2 */
    set_factor(0, p.header.piece_count, (1u << 14) + (1u << 12));        /* 1.25 */
    set_factor(10, p.header.piece_count - 10u, (1u << 14) + (1u << 13)); /* 1.5 */
    timebase_begin(&tb, &p, 1000);
    timebase_override(&tb, 999);
    for (uint32_t k = 0; timebase_state(&tb) != TIMEBASE_ENDED; k++) {
        timebase_step(&tb);
        last = timebase_rate_q30(&tb) != 0 ? timebase_rate_q30(&tb) : last;
        most = last > most ? last : most;
        TEST_ASSERT_TRUE(k < 2 || timebase_saturated(&tb) || timebase_rate_q30(&tb) == 0);
    }
    TEST_ASSERT_UINT32_WITHIN(1, 3u << 29, most);
    TEST_ASSERT_UINT32_WITHIN(1, 5u << 28, last);
}

static void test_start_from_a_position(void)
{
    timebase_begin_at(&tb, &p, 1000, UINT64_C(1) << 41);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 31, timebase_step(&tb));
    TEST_ASSERT_EQUAL_UINT32(0, timebase_rate_q30(&tb));
    TEST_ASSERT_EQUAL_INT(TIMEBASE_RUNNING, timebase_state(&tb));
    steps_to(TIMEBASE_ENDED);
    timebase_begin_at(&tb, &p, 1000, UINT64_MAX);
    TEST_ASSERT_EQUAL_UINT64(p.header.duration_q32_s, timebase_step(&tb));
    TEST_ASSERT_EQUAL_INT(TIMEBASE_ENDED, timebase_state(&tb));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_ticks_are_exact);
    RUN_TEST(test_ends_with_the_last_tick);
    RUN_TEST(test_stop_keeps_the_bounds);
    RUN_TEST(test_stop_for_any_bounds);
    RUN_TEST(test_stop_as_slow_as_can_be_ends_with_the_program);
    RUN_TEST(test_hold_and_resume);
    RUN_TEST(test_stop_is_final);
    RUN_TEST(test_stop_of_a_held_one);
    RUN_TEST(test_before_the_first_tick);
    RUN_TEST(test_override);
    RUN_TEST(test_override_saturates);
    RUN_TEST(test_start_from_a_position);
    return UNITY_END();
}
