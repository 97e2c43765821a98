/* SPDX-License-Identifier: MIT */
/* Tests of core/path_brake.h: a path stop: an S-curve of path speed, decided anew in each tick. Run by `make unit`;
 * no I/O. */
#include "core/path_brake.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "golden.h"
#include "unity.h"

#define UNIT          72057594037927936.0 /* 2^56 */
#define Q40           1099511627776.0
#define CASES         200000
#define MORE_TICKS    6
#define MORE_IN_SHORT 10

static uint64_t random_state;

void setUp(void)
{
    random_state = 23;
}

void tearDown(void)
{
}

static double uniform(double low, double high)
{
    return low + (high - low) * (double)(golden_random(&random_state) >> 11) / 9007199254740992.0;
}

static double spread(double low, double high)
{
    return low * pow(high / low, uniform(0, 1));
}

/* mm and s */
struct brake_case {
    double speed, acceleration, down, most, up, period;
};

static struct brake_case random_case(void)
{
    struct brake_case c = {.speed = spread(0.1, 500),
                           .down = spread(1e3, 1e6),
                           .most = spread(50, 1e4),
                           .up = spread(1e3, 1e6),
                           .period = 1e-3 * (double)(1u << (golden_random(&random_state) % 4u))};
    c.acceleration = uniform(-1.5, 1.5) * c.most;
    return c;
}

static struct path_state state_of(const struct brake_case *c)
{
    const double h = c->period;
    return (struct path_state){.arc_length_q40_mm = (int64_t)7 << 40,
                               .speed_q56 = llrint(c->speed * h * UNIT),
                               .acceleration_q56 = llrint(c->acceleration * h * h * UNIT)};
}

static struct path_brake_numbers numbers_of(const struct brake_case *c)
{
    const double h = c->period;
    return (struct path_brake_numbers){llrint(c->down * h * h * h * UNIT),
                                       llrint(c->most * h * h * UNIT),
                                       llrint(c->up * h * h * h * UNIT)};
}

/* Ticks of the continuous brake; below 0: there is none. */
static double continuous_ticks(const struct brake_case *c)
{
    const double lead = c->acceleration / c->down;
    const double ratio = c->down / c->up;
    const double peak = sqrt((2 * c->speed / c->down + lead * lead) / (1 + ratio));
    const double used = fmin(peak, c->most / c->down);
    const double first = fabs(lead + used);
    const double last = used * ratio;
    const double left = c->speed + c->acceleration * first / 2;
    const double even = peak > used ? left / c->most - first / 2 - last / 2 : 0;
    if (lead + used < 0 && peak <= used) {
        return -1;
    }
    return left > 0 && even >= 0 ? (first + even + last) / c->period : -1;
}

static void test_codes(void)
{
    struct path_brake_numbers n;
    const struct program_stop stop = {.jerk_down = 64, .deceleration = 64, .jerk_up = 255};
    for (uint32_t p = 0; p < 4; p++) {
        const double ms = 1u << p;
        TEST_ASSERT_TRUE(path_brake_numbers_of(&n, &stop, 1000u << p));
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0,
                                  (double)n.jerk_down_q56 / UNIT / (64e-9 * ms * ms * ms));
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, (double)n.deceleration_q56 / UNIT / (1e-6 * ms * ms));
        TEST_ASSERT_TRUE(n.jerk_up_q56 >= (int64_t)1 << 55);
    }
}

static void test_codes_are_rounded_down(void)
{
    static const double mantissa[8] = {65536, 71468, 77935, 84990, 92681, 101070, 110217, 120193};
    for (uint32_t c = 1; c < 256; c++) {
        const struct program_stop stop = {
            .jerk_down = (uint8_t)c, .deceleration = (uint8_t)c, .jerk_up = (uint8_t)c};
        struct path_brake_numbers n;
        const double exact = mantissa[c & 7u] * exp2(c >> 3);
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, 1, exact / (65536 * exp2(c / 8.0)));
        TEST_ASSERT_TRUE(path_brake_numbers_of(&n, &stop, 1000));
        const double jerk = fmin(exact / 262144 * 1e-9 * UNIT, UNIT * 16);
        const double deceleration = fmin(exact / 16777216 * 1e-6 * UNIT, UNIT * 16);
        TEST_ASSERT_TRUE((double)n.jerk_down_q56 <= jerk);
        TEST_ASSERT_TRUE((double)n.jerk_down_q56 >= jerk * 0.999999 - 1);
        TEST_ASSERT_TRUE((double)n.deceleration_q56 <= deceleration);
        TEST_ASSERT_TRUE((double)n.deceleration_q56 >= deceleration * 0.999999 - 1);
        TEST_ASSERT_EQUAL_INT64(n.jerk_down_q56, n.jerk_up_q56);
    }
}

static void test_code_0_is_no_brake(void)
{
    struct path_brake_numbers n;
    const struct program_stop stop = {.jerk_down = 100, .deceleration = 0, .jerk_up = 100};
    TEST_ASSERT_FALSE(path_brake_numbers_of(&n, &stop, 1000));
}

static int64_t way_q56(const struct path_state *a, const struct path_state *b)
{
    return (b->arc_length_q40_mm - a->arc_length_q40_mm) * 65536 + (int64_t)b->fine_q56_mm -
           (int64_t)a->fine_q56_mm;
}

static int64_t way_from(const struct path_state *a, const struct path_state *b)
{
    return b->arc_length_q40_mm - a->arc_length_q40_mm;
}

/* From 100 mm/s at 1 ms: 20 ms of jerk to 2000 mm/s^2, 30 ms of that, 20 ms to rest: 3.5 mm. */
static void test_of_a_book(void)
{
    const struct brake_case c = {100, 0, 1e5, 2000, 1e5, 1e-3};
    const struct path_state from = state_of(&c);
    const struct path_brake_numbers numbers = numbers_of(&c);
    struct path_brake brake;
    int ticks = 0;
    TEST_ASSERT_TRUE(path_brake_begin(&brake, &from, &numbers));
    for (; !path_brake_ended(&brake) && ticks < 100; ticks++) {
        path_brake_step(&brake);
    }
    TEST_ASSERT_INT_WITHIN(2, 71, ticks);
    TEST_ASSERT_DOUBLE_WITHIN(0.06, 3.5, (double)way_from(&from, &brake.at) / Q40);
}

/* The first step changes the acceleration by this; sixths are rounded, so up to 6 units less. */
static void expect_first_step(int64_t acceleration_q56, int64_t change_q56)
{
    const struct path_brake_numbers n = {(int64_t)1 << 40, (int64_t)1 << 44, (int64_t)1 << 40};
    const struct path_state from = {.speed_q56 = (int64_t)1 << 50,
                                    .acceleration_q56 = acceleration_q56};
    struct path_brake brake;
    TEST_ASSERT_TRUE(path_brake_begin(&brake, &from, &n));
    path_brake_step(&brake);
    TEST_ASSERT_INT64_WITHIN((uint64_t)(6 + (labs(change_q56) >> 30)),
                             acceleration_q56 + change_q56, brake.at.acceleration_q56);
}

/* Towards the deceleration, from above it and from below, and not beyond it. */
static void test_acceleration_goes_to_the_deceleration(void)
{
    const int64_t jerk = (int64_t)1 << 40;
    const int64_t most = (int64_t)1 << 44;
    expect_first_step(0, -jerk);
    expect_first_step(3 * jerk, -jerk);
    expect_first_step(-most + jerk / 2, -jerk / 2);
    expect_first_step(-most, 0);
    expect_first_step(-most - jerk / 2, jerk / 2);
    expect_first_step(-most - 5 * jerk, jerk);
}

/* A state from which the release phase just fits, b^2 + 6 j b = 2 j v, at so low a jerk that the greatest deceleration
 * as it is computed is below b (docs/theory/numerics.md section 12, "Path stop"): b stays for a tick, and does not rise
 * before the release phase. */
static void test_no_rise_before_the_release_phase(void)
{
    const int64_t jerk = (int64_t)1 << 34;
    const int64_t fall = (int64_t)1 << 44;
    const struct path_brake_numbers n = {jerk, 2 * fall, jerk};
    const int64_t speed = ((int64_t)1 << 53) + 3 * fall;
    const struct path_state from = {.speed_q56 = speed + (speed >> 26), .acceleration_q56 = -fall};
    struct path_brake brake;
    TEST_ASSERT_TRUE(path_brake_begin(&brake, &from, &n));
    path_brake_step(&brake);
    TEST_ASSERT_EQUAL_INT64(-fall, brake.at.acceleration_q56);
    TEST_ASSERT_EQUAL_INT64(from.speed_q56 - fall, brake.at.speed_q56);
    path_brake_step(&brake);
    TEST_ASSERT_TRUE(brake.at.acceleration_q56 > -fall);
}

/* A brake whose first tick is in place of a step: with acceleration `a` at its begin. */
static void expect_first_tick(int64_t a, int64_t change)
{
    const struct path_brake_numbers n = {(int64_t)6 << 38, (int64_t)1 << 44, (int64_t)1 << 40};
    const struct path_state from = {.arc_length_q40_mm = 12345,
                                    .fine_q56_mm = 54321,
                                    .speed_q56 = (int64_t)1 << 50,
                                    .acceleration_q56 = a};
    struct path_brake brake;
    TEST_ASSERT_TRUE(path_brake_begin(&brake, &from, &n));
    path_brake_first(&brake);
    const uint64_t slack = (uint64_t)(6 + (-change >> 30));
    TEST_ASSERT_INT64_WITHIN(slack, a + change, brake.at.acceleration_q56);
    TEST_ASSERT_INT64_WITHIN(slack, from.speed_q56 + a + change / 2, brake.at.speed_q56);
    TEST_ASSERT_INT64_WITHIN(slack, from.speed_q56 + a / 2 + change / 6, way_q56(&from, &brake.at));
    TEST_ASSERT_FALSE(path_brake_ended(&brake));
}

/* An acceleration above 0 falls by the first jerk at most, and as far as 0; one below stays. */
static void test_first_tick(void)
{
    const int64_t jerk = (int64_t)6 << 38;
    expect_first_tick(3 * jerk, -jerk);
    expect_first_tick(jerk, -jerk);
    expect_first_tick(jerk / 3, -jerk / 3);
    expect_first_tick(0, 0);
    expect_first_tick(-jerk, 0);
}

/* The state and its numbers in 2^-56 mm and ticks keep what they promise in one tick: a cubic from the state before to
 * the state after. `slack`: what rounding may add to the last jerk. */
static void check_tick(const struct path_state *a, const struct path_state *b,
                       const struct path_brake_numbers *n, int64_t first_acceleration,
                       int64_t slack)
{
    const int64_t j = b->acceleration_q56 - a->acceleration_q56;
    const int64_t way = way_q56(a, b);
    const int64_t most = n->deceleration_q56;
    const int64_t rise = n->jerk_up_q56 > n->jerk_down_q56 ? n->jerk_up_q56 : n->jerk_down_q56;
    TEST_ASSERT_TRUE(-j <= n->jerk_down_q56 + slack);
    TEST_ASSERT_TRUE(j <= rise + slack);
    TEST_ASSERT_TRUE(b->acceleration_q56 + slack >=
                     (first_acceleration < -most ? first_acceleration : -most));
    TEST_ASSERT_TRUE(labs(2 * (b->speed_q56 - a->speed_q56) - 2 * a->acceleration_q56 - j) <=
                     slack);
    TEST_ASSERT_TRUE(labs(way - a->speed_q56 - a->acceleration_q56 / 2 - j / 6) <= slack);
    TEST_ASSERT_TRUE(b->speed_q56 >= 0);
    TEST_ASSERT_TRUE(way >= 0);
}

/* Ticks until standstill. */
static int check_brake(struct path_brake *brake, const struct path_brake_numbers *n)
{
    const int64_t first_acceleration = brake->at.acceleration_q56;
    struct path_state before = brake->at;
    int ticks = 0;
    for (; !path_brake_ended(brake); ticks++) {
        path_brake_step(brake);
        const int64_t settling = (int64_t)brake->settle_ticks + 16;
        check_tick(&before, &brake->at, n, first_acceleration, 8 * settling * settling + 64);
        before = brake->at;
        TEST_ASSERT_TRUE(ticks < 300000);
    }
    TEST_ASSERT_EQUAL_INT64(0, before.speed_q56);
    TEST_ASSERT_EQUAL_INT64(0, before.acceleration_q56);
    path_brake_step(brake);
    TEST_ASSERT_EQUAL_MEMORY(&before, &brake->at, sizeof before);
    return ticks;
}

static bool ordinary(const struct brake_case *c)
{
    const double a = c->acceleration;
    const double least = a < 0 ? a * a / (2 * c->up) - 3.1 * a * c->period : 0;
    const double most_speed = c->speed + (a > 0 ? a * a / (2 * c->down) : 0);
    return a > -0.1 * c->most && a < 0.5 * c->most && most_speed * c->period < 4 &&
           c->most < 4000 * c->period * fmin(c->down, c->up) && c->speed > least;
}

/* The distance that path_brake_fits computes for a brake: the least one in which a brake fits by its result. */
static int64_t bound_of(const struct path_state *from, const struct path_brake_numbers *n)
{
    int64_t low = 0;
    int64_t high = (int64_t)1 << 60;
    TEST_ASSERT_TRUE(path_brake_fits(from, n, high));
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        *(path_brake_fits(from, n, middle) ? &high : &low) = middle;
    }
    return high;
}

/* Distance of a brake whose first tick is in place of a step. */
static int64_t way_of_stop(const struct path_state *from, const struct path_brake_numbers *n)
{
    struct path_brake brake;
    TEST_ASSERT_TRUE(path_brake_begin(&brake, from, n));
    path_brake_first(&brake);
    while (!path_brake_ended(&brake)) {
        path_brake_step(&brake);
    }
    return way_from(from, &brake.at);
}

/* A brake out of a motion that comes to its end needs no more than is promised, and at most two ticks of its speed
 * less. */
static void test_bound_near_the_end_of_a_program(void)
{
    for (uint32_t i = 0; i < CASES / 10; i++) {
        struct brake_case c = {.speed = spread(4, 50), .most = 5000, .period = 1e-3};
        c.down = c.up = spread(5e4, 2e5);
        c.acceleration = -uniform(0.2, 0.9) * sqrt(c.speed * c.up);
        const struct path_state from = state_of(&c);
        const struct path_brake_numbers n = numbers_of(&c);
        struct path_brake brake;
        if (path_brake_begin(&brake, &from, &n)) {
            const int64_t spare = bound_of(&from, &n) - way_of_stop(&from, &n);
            TEST_ASSERT_TRUE(spare >= 0);
            TEST_ASSERT_TRUE((double)spare <= 2 * c.speed * c.period * Q40);
        }
    }
}

/* The end of the alpha: 27.4 ms before it 0.126 mm are left. */
static void test_bound_at_the_end_of_the_alpha(void)
{
    const struct brake_case c = {14.925, -1175.35, 185362, 4870.9, 185362, 1e-3};
    const struct path_state from = state_of(&c);
    const struct path_brake_numbers n = numbers_of(&c);
    TEST_ASSERT_TRUE(path_brake_fits(&from, &n, (int64_t)(0.126 * Q40)));
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.0857, (double)way_of_stop(&from, &n) / Q40);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.1019, (double)bound_of(&from, &n) / Q40);
}

/* Found by search: the brakes that come nearest to the bound. */
static void test_brakes_nearest_to_the_bound(void)
{
    static const struct brake_case cases[] = {
        {9.341, 0.085, 587600, 833.6, 104200, 1e-3},
        {5.08, -7.36, 686000, 969, 428000, 1e-3},
        {167, -1.85, 48600, 2750, 47300, 1e-3},
        {0.804, 30800, 475e6, 31400, 556000, 1e-3},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct path_state from = state_of(&cases[i]);
        const struct path_brake_numbers n = numbers_of(&cases[i]);
        TEST_ASSERT_TRUE(bound_of(&from, &n) >= way_of_stop(&from, &n));
    }
}

/* Any brake keeps its numbers in every tick and rests exactly. Where the continuous one takes 30 ticks and more, and
 * the acceleration is below half the deceleration, there is one. No brake takes MORE_TICKS more than the continuous
 * one; a short one with a slow last jerk takes MORE_IN_SHORT. path_brake_fits never promises less than a brake takes,
 * with its first tick in place of a step or without. */
static void test_random_brakes(void)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < CASES; i++) {
        const struct brake_case c = random_case();
        const struct path_state from = state_of(&c);
        const struct path_brake_numbers numbers = numbers_of(&c);
        const double least = continuous_ticks(&c);
        struct path_brake brake;
        const int begins = path_brake_begin(&brake, &from, &numbers);
        if (!begins) {
            TEST_ASSERT_FALSE(ordinary(&c) && least >= 30 && least < 3000 && c.up > 0.05 * c.down);
            continue;
        }
        found++;
        const int ticks = check_brake(&brake, &numbers);
        const int64_t way = way_from(&from, &brake.at);
        if (ordinary(&c) && least >= 0) {
            TEST_ASSERT_TRUE(ticks >= least - 0.01);
            TEST_ASSERT_TRUE(ticks <= least + (least < 25 ? MORE_IN_SHORT : MORE_TICKS));
        }
        TEST_ASSERT_FALSE(path_brake_fits(&from, &numbers, way - 1));
        TEST_ASSERT_FALSE(path_brake_fits(&from, &numbers, way_of_stop(&from, &numbers) - 1));
    }
    TEST_ASSERT_TRUE(found > CASES / 2);
}

static void refused(int64_t speed_q56, int64_t acceleration_q56)
{
    const struct path_brake_numbers numbers = {(int64_t)1 << 40, (int64_t)1 << 45,
                                               (int64_t)1 << 40};
    const struct path_state from = {.speed_q56 = speed_q56, .acceleration_q56 = acceleration_q56};
    struct path_brake brake;
    struct path_brake before;
    memset(&brake, 0x5A, sizeof brake);
    before = brake;
    TEST_ASSERT_FALSE(path_brake_begin(&brake, &from, &numbers));
    TEST_ASSERT_EQUAL_MEMORY(&before, &brake, sizeof brake);
}

static void test_refused_states(void)
{
    refused(0, 0);
    refused(PATH_BRAKE_NO_SPEED - 1, 0);
    refused(-PATH_BRAKE_NO_SPEED, 0);
    refused(INT64_MIN, 0);
    refused(PATH_BRAKE_MOST_SPEED + 1, 0);
    refused(INT64_MAX, 0);
    refused((int64_t)1 << 50, INT64_MAX);
    refused((int64_t)1 << 50, -INT64_MAX);
    refused((int64_t)1 << 50, -((int64_t)1 << 49)); /* speed would pass 0 */
    refused(PATH_BRAKE_MOST_SPEED, 0);              /* too many ticks */
}

/* Whatever the state and the numbers are, nothing overflows (the sanitizers watch) and a brake that is found ends at
 * rest. */
static void test_extreme_numbers(void)
{
    for (uint32_t i = 0; i < CASES; i++) {
        const struct path_brake_numbers n = {
            (int64_t)(golden_random(&random_state) >> (4 + golden_random(&random_state) % 60u)) | 1,
            (int64_t)(golden_random(&random_state) >> (4 + golden_random(&random_state) % 60u)) | 1,
            (int64_t)(golden_random(&random_state) >> (4 + golden_random(&random_state) % 60u)) |
                1};
        const struct path_state from = {
            .speed_q56 =
                (int64_t)(golden_random(&random_state) >> (2 + golden_random(&random_state) % 60u)),
            .acceleration_q56 =
                (int64_t)golden_random(&random_state) >> (3 + golden_random(&random_state) % 60u)};
        struct path_brake brake;
        const int64_t jerk = n.jerk_up_q56 < n.jerk_down_q56 ? n.jerk_up_q56 : n.jerk_down_q56;
        if (jerk < 1 << 22 || n.deceleration_q56 < 1 << 22 || n.deceleration_q56 / 4096 >= jerk) {
            continue;
        }
        if (path_brake_begin(&brake, &from, &n)) {
            for (int tick = 0; !path_brake_ended(&brake); tick++) {
                TEST_ASSERT_TRUE(tick < 300000);
                path_brake_step(&brake);
            }
            TEST_ASSERT_EQUAL_INT64(0, brake.at.speed_q56);
            TEST_ASSERT_EQUAL_INT64(0, brake.at.acceleration_q56);
        }
        (void)path_brake_fits(&from, &n, (int64_t)(golden_random(&random_state) >> 2));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_codes);
    RUN_TEST(test_codes_are_rounded_down);
    RUN_TEST(test_code_0_is_no_brake);
    RUN_TEST(test_of_a_book);
    RUN_TEST(test_acceleration_goes_to_the_deceleration);
    RUN_TEST(test_no_rise_before_the_release_phase);
    RUN_TEST(test_first_tick);
    RUN_TEST(test_random_brakes);
    RUN_TEST(test_bound_near_the_end_of_a_program);
    RUN_TEST(test_bound_at_the_end_of_the_alpha);
    RUN_TEST(test_brakes_nearest_to_the_bound);
    RUN_TEST(test_refused_states);
    RUN_TEST(test_extreme_numbers);
    return UNITY_END();
}
