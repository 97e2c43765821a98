/* SPDX-License-Identifier: MIT */
/* Events of a program: what the check refuses, and what a tick makes of them. Run by `make unit`; reads files of
 * tests/data. */
#include "core/path_outputs.h"

#include <stdlib.h>
#include <string.h>

#include "core/crc32.h"
#include "core/feed_override.h"
#include "core/interpolator.h"
#include "golden.h"
#include "unity.h"

#define MOST_EVENTS 64u
#define TABLES      10000u
#define NAME        "alpha_minimax.hdgp"

static struct program base;
static uint8_t *image;
static struct program program;

static void put(uint8_t *at, uint64_t value, uint32_t bytes)
{
    for (uint32_t i = 0; i < bytes; i++) {
        at[i] = (uint8_t)(value >> (8u * i));
    }
}

static uint8_t *event_at(uint32_t i)
{
    return image + base.size + i * PROGRAM_EVENT_SIZE;
}

static void set_event(uint32_t i, const struct program_event *event)
{
    uint8_t *at = event_at(i);
    put(at, (uint64_t)event->place_q40_mm, 8);
    at[8] = event->kind;
    at[9] = event->channel;
    put(at + 10, event->mask, 2);
    put(at + 12, (uint32_t)event->value, 4);
}

/* Opens the image with so many of the events that have been set. */
static int open_with(uint32_t count)
{
    const uint32_t size = base.size + count * PROGRAM_EVENT_SIZE;
    put(image + 76, count, 4);
    put(image + 8, size, 4);
    golden_seal(image, size);
    return program_open(&program, image, size);
}

static int check_with(uint32_t count, uint32_t *index)
{
    const struct program_limits limits = golden_no_limits();
    struct program_fault fault;
    TEST_ASSERT_EQUAL_INT(0, open_with(count));
    (void)program_check(&program, &limits, &fault);
    *index = fault.index;
    return fault.code;
}

void setUp(void)
{
    golden_open(&base, NAME);
    image = malloc(base.size + MOST_EVENTS * PROGRAM_EVENT_SIZE);
    TEST_ASSERT_NOT_NULL(image);
    memcpy(image, base.image, base.size);
}

void tearDown(void)
{
    free(image);
    golden_close(&base);
}

static void refuse(const struct program_event *event, int code)
{
    const struct program_event good = {0, PROGRAM_EVENT_DIGITAL, 0, 3, 1};
    uint32_t index = 0;
    set_event(0, &good);
    set_event(1, event);
    TEST_ASSERT_EQUAL_INT(code, check_with(2, &index));
    TEST_ASSERT_EQUAL_UINT32(code == 0 ? 0u : 1u, index);
}

static void test_check_of_one_event(void)
{
    const int64_t end = base.header.length_q40_mm;
    refuse(&(struct program_event){end, PROGRAM_EVENT_DIGITAL, 0, 0xFFFF, 0xFFFF}, 0);
    refuse(&(struct program_event){end, PROGRAM_EVENT_ANALOGUE, 2, 0, INT16_MIN}, 0);
    refuse(&(struct program_event){end, PROGRAM_EVENT_PROPORTIONAL, 0, 0, INT32_MIN}, 0);
    refuse(&(struct program_event){0, 0, 0, 1, 1}, PROGRAM_ERR_EVENT_KIND);
    refuse(&(struct program_event){0, 4, 0, 1, 1}, PROGRAM_ERR_EVENT_KIND);
    refuse(&(struct program_event){0, PROGRAM_EVENT_DIGITAL, 1, 1, 1}, PROGRAM_ERR_EVENT_KIND);
    refuse(&(struct program_event){0, PROGRAM_EVENT_ANALOGUE, 3, 0, 1}, PROGRAM_ERR_EVENT_KIND);
    refuse(&(struct program_event){0, PROGRAM_EVENT_DIGITAL, 0, 0, 0}, PROGRAM_ERR_EVENT_VALUE);
    refuse(&(struct program_event){0, PROGRAM_EVENT_DIGITAL, 0, 1, 2}, PROGRAM_ERR_EVENT_VALUE);
    refuse(&(struct program_event){0, PROGRAM_EVENT_DIGITAL, 0, 1, 65537}, PROGRAM_ERR_EVENT_VALUE);
    refuse(&(struct program_event){0, PROGRAM_EVENT_ANALOGUE, 0, 1, 1}, PROGRAM_ERR_EVENT_VALUE);
    refuse(&(struct program_event){0, PROGRAM_EVENT_ANALOGUE, 0, 0, 32768},
           PROGRAM_ERR_EVENT_VALUE);
    refuse(&(struct program_event){-1, PROGRAM_EVENT_DIGITAL, 0, 1, 1}, PROGRAM_ERR_EVENT_PLACE);
    refuse(&(struct program_event){end + 1, PROGRAM_EVENT_DIGITAL, 0, 1, 1},
           PROGRAM_ERR_EVENT_PLACE);
}

static void test_order_and_density(void)
{
    const int64_t middle = base.header.length_q40_mm / 2;
    uint32_t index = 0;
    for (uint32_t i = 0; i < 2u * PROGRAM_EVENTS_A_TICK; i++) {
        const struct program_event one = {middle, PROGRAM_EVENT_DIGITAL, 0, 1, (int32_t)(i & 1u)};
        set_event(i, &one);
    }
    TEST_ASSERT_EQUAL_INT(0, check_with(PROGRAM_EVENTS_A_TICK, &index));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_EVENT_DENSE, check_with(PROGRAM_EVENTS_A_TICK + 1u, &index));
    TEST_ASSERT_EQUAL_UINT32(PROGRAM_EVENTS_A_TICK, index);
    put(event_at(5), (uint64_t)(middle + 1), 8);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_EVENT_PLACE, check_with(8, &index));
    TEST_ASSERT_EQUAL_UINT32(6, index);
}

static void test_sizes_that_do_not_fit(void)
{
    TEST_ASSERT_EQUAL_INT(0, open_with(0));
    put(image + 76, 1, 4);
    golden_seal(image, base.size);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_open(&program, image, base.size));
    put(image + 76, 0x10000000u, 4); /* 2^32 bytes more */
    golden_seal(image, base.size);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_SIZE, program_open(&program, image, base.size));
}

/* Bytes of the table changed at random: what the check accepts does not fail in a run. */
static void test_mutated_tables(void)
{
    uint64_t random = 7;
    uint32_t accepted = 0;
    for (uint32_t round = 0; round < 3000u; round++) {
        uint32_t index = 0;
        const struct program_event first = {1, PROGRAM_EVENT_DIGITAL, 0, 5, 4};
        const struct program_event second = {9, PROGRAM_EVENT_PROPORTIONAL, 1, 0, -70000};
        set_event(0, &first);
        set_event(1, &second);
        const uint64_t r = golden_random(&random);
        event_at(0)[r % (2u * PROGRAM_EVENT_SIZE)] ^= (uint8_t)(1u << ((r >> 32) & 7u));
        if (check_with(2, &index) == 0) {
            struct path_outputs outputs;
            accepted++;
            path_outputs_begin(&outputs, &program, -1);
            for (int64_t at = 0; at <= program.header.length_q40_mm;
                 at += program.header.length_q40_mm / 16) {
                path_outputs_step(&outputs, at, (int64_t)(r >> 20));
            }
        } else {
            TEST_ASSERT_TRUE(index < 2u);
        }
    }
    TEST_ASSERT_TRUE(accepted > 300u && accepted < 2700u);
}

/* ---- A run ---- */

static uint32_t tick_of(const struct interpolator_point *points, uint32_t count, int64_t place)
{
    uint32_t tick = 0;
    while (tick < count && points[tick].arc_length_q40_mm < place) {
        tick++;
    }
    return tick;
}

/* Random tables along a run at changing override: each event acts at the first setpoint at or past its place, in
 * order. */
static void test_random_tables_act_in_the_right_tick(void)
{
    enum { MOST_TICKS = 20000 };
    static struct interpolator_point points[MOST_TICKS];
    struct golden_precomputed precomputed;
    struct interpolator it;
    struct feed_override feed;
    uint64_t random = 42;
    uint32_t count = 0;
    TEST_ASSERT_EQUAL_INT(0, open_with(0));
    golden_precompute(&precomputed, &program, KERNEL_FIXED);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &precomputed.program));
    feed_override_begin(&feed, &precomputed.program, 1000, 0);
    while (feed_override_state(&feed) != FEED_ENDED && count < MOST_TICKS) {
        if (count % 97u == 0u) {
            feed_override_set(&feed, (uint32_t)(golden_random(&random) % 201u));
        }
        TEST_ASSERT_TRUE(feed_override_next(&feed, &it, &points[count++]) >= 0);
    }
    TEST_ASSERT_TRUE(count < MOST_TICKS);
    for (uint32_t table = 0; table < TABLES; table++) {
        const uint32_t events = 1u + (uint32_t)(golden_random(&random) % 6u);
        int64_t place = 0;
        struct path_outputs outputs;
        for (uint32_t i = 0; i < events; i++) {
            const uint64_t way = golden_random(&random) % (uint64_t)(base.header.length_q40_mm / 6);
            place += i % 3u == 2u ? 0 : (int64_t)way;
            const struct program_event event = {place, PROGRAM_EVENT_ANALOGUE, 0, 0,
                                                (int32_t)i + 1};
            set_event(i, &event);
        }
        TEST_ASSERT_EQUAL_INT(0, open_with(events));
        path_outputs_begin(&outputs, &program, -1);
        uint32_t from = 0;
        for (uint32_t i = 0; i < events; i++) {
            const uint32_t to = tick_of(points, count, program_event_place(&program, i));
            for (uint32_t tick = from; tick < to; tick += 1u + (to - from) / 4u) {
                path_outputs_step(&outputs, points[tick].arc_length_q40_mm, 0);
                TEST_ASSERT_EQUAL_INT16(i, outputs.values.analogue[0]);
            }
            if (to > from) {
                path_outputs_step(&outputs, points[to - 1u].arc_length_q40_mm, 0);
                TEST_ASSERT_EQUAL_INT16(i, outputs.values.analogue[0]);
            }
            path_outputs_step(&outputs, points[to].arc_length_q40_mm, 0);
            TEST_ASSERT_TRUE(outputs.values.analogue[0] >= (int16_t)i + 1);
            from = to;
            while (i + 1u < events &&
                   tick_of(points, count, program_event_place(&program, i + 1u)) == to) {
                i++;
            }
        }
        TEST_ASSERT_EQUAL_INT16(events, outputs.values.analogue[0]);
        TEST_ASSERT_NULL(outputs.program);
    }
    golden_discard(&precomputed);
}

static void test_a_start_and_a_takeover_find_the_next_event(void)
{
    const int64_t places[] = {0, 5, 5, 9};
    struct path_outputs outputs;
    for (uint32_t i = 0; i < 4u; i++) {
        const struct program_event one = {places[i], PROGRAM_EVENT_DIGITAL, 0, (uint16_t)(1u << i),
                                          1 << i};
        set_event(i, &one);
    }
    TEST_ASSERT_EQUAL_INT(0, open_with(4));
    TEST_ASSERT_EQUAL_UINT32(1, program_first_event_from(&program, 5));
    TEST_ASSERT_EQUAL_UINT32(3, program_first_event_from(&program, 6));
    TEST_ASSERT_EQUAL_UINT32(4, program_first_event_from(&program, 10));
    path_outputs_begin(&outputs, &program, 5);
    TEST_ASSERT_EQUAL_HEX16(7, outputs.values.digital);
    path_outputs_step(&outputs, 9, 0);
    TEST_ASSERT_EQUAL_HEX16(15, outputs.values.digital);
    path_outputs_carry(&outputs, &program, &program, 0);
    TEST_ASSERT_NULL(outputs.program);
    path_outputs_clear(&outputs);
    outputs.values.digital = 0x100;
    path_outputs_begin_next(&outputs, &program);
    TEST_ASSERT_EQUAL_HEX16(0x100, outputs.values.digital);
    path_outputs_step(&outputs, 0, 0);
    TEST_ASSERT_EQUAL_HEX16(0x101, outputs.values.digital);
}

static void set_values(const int64_t places[], uint32_t count, int32_t first_value)
{
    for (uint32_t i = 0; i < count; i++) {
        const struct program_event one = {places[i], PROGRAM_EVENT_ANALOGUE, 0, 0,
                                          first_value + (int32_t)i};
        set_event(i, &one);
    }
    TEST_ASSERT_EQUAL_INT(0, open_with(count));
}

/* A program that begins at 5 of another one, where that has two events: each acts once, wherever the takeover
 * happens. */
static void test_a_takeover_goes_on_with_the_same_event(void)
{
    const int64_t places[] = {0, 5, 5, 9};
    const int64_t shifted[] = {0, 0, 4};
    const int64_t taken_over_at[] = {4, 5, 9};
    uint8_t whole[8192];
    struct program before;
    set_values(places, 4, 10);
    TEST_ASSERT_TRUE(program.size <= sizeof whole);
    memcpy(whole, image, program.size);
    TEST_ASSERT_EQUAL_INT(0, program_open(&before, whole, program.size));
    set_values(shifted, 3, 11);
    for (uint32_t i = 0; i < 3u; i++) {
        struct path_outputs outputs;
        path_outputs_begin(&outputs, &before, taken_over_at[i]);
        path_outputs_carry(&outputs, &before, &program, 5);
        outputs.values.analogue[0] = 0;
        path_outputs_step(&outputs, 3, 0);
        TEST_ASSERT_EQUAL_INT16(i == 0u ? 12 : 0, outputs.values.analogue[0]);
        path_outputs_step(&outputs, 4, 0);
        TEST_ASSERT_EQUAL_INT16(i == 2u ? 0 : 13, outputs.values.analogue[0]);
        TEST_ASSERT_NULL(outputs.program);
    }
    /* before the first setpoint, or a rounding unit before the place: none is left out */
    struct path_outputs outputs;
    path_outputs_begin(&outputs, &before, -1);
    path_outputs_carry(&outputs, &before, &program, 5);
    path_outputs_step(&outputs, 0, 0);
    TEST_ASSERT_EQUAL_INT16(12, outputs.values.analogue[0]);
}

static void proportional(int32_t gain_q16, int64_t feed_q32, int16_t value)
{
    const struct program_event one = {0, PROGRAM_EVENT_PROPORTIONAL, 1, 0, gain_q16};
    struct path_outputs outputs;
    set_event(0, &one);
    TEST_ASSERT_EQUAL_INT(0, open_with(1));
    path_outputs_begin(&outputs, &program, -1);
    path_outputs_step(&outputs, 0, feed_q32);
    TEST_ASSERT_EQUAL_INT16(value, outputs.values.analogue[1]);
}

static void test_proportional_values(void)
{
    proportional(65536, INT64_C(100) << 32, 100);
    proportional(-65536, INT64_C(100) << 32, -100);
    proportional(32768, INT64_C(101) << 32, 51); /* 50.5 */
    proportional(65536, 0, 0);
    proportional(65536, -(INT64_C(1) << 20), 0); /* a feed that is rounded to run back */
    proportional(INT32_MAX, INT64_C(4000) << 32, INT16_MAX);
    proportional(INT32_MIN, INT64_MAX, INT16_MIN);
    proportional(1, INT64_MAX, 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_check_of_one_event);
    RUN_TEST(test_order_and_density);
    RUN_TEST(test_sizes_that_do_not_fit);
    RUN_TEST(test_mutated_tables);
    RUN_TEST(test_random_tables_act_in_the_right_tick);
    RUN_TEST(test_a_start_and_a_takeover_find_the_next_event);
    RUN_TEST(test_a_takeover_goes_on_with_the_same_event);
    RUN_TEST(test_proportional_values);
    return UNITY_END();
}
