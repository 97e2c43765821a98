/* SPDX-License-Identifier: MIT */
/* A motion with a cache of records has the setpoints that it has with all of them, whatever the size of the cache;
 * and where the main loop makes none, the tick is refused and nothing else is read. Run by `make unit`; reads files
 * of tests/data. */
#include "core/coefficient_cache.h"

#include <stdlib.h>
#include <string.h>

#include "core/chunk.h"
#include "golden.h"
#include "unity.h"

#define MOST_BYTES 65536u

static const char *const NAMES[] = {"alpha_minimax.hdgp", "star_minimax.hdgp", "line_tiny.hdgp",
                                    "space3.hdgp", "space6.hdgp"};
#define NAME_COUNT (sizeof NAMES / sizeof *NAMES)

struct motion {
    struct feed_override feed;
    struct interpolator it;
    struct interpolator_point point;
};

static uint64_t memory[MOST_BYTES / 8u];
static struct coefficient_cache cache;
static struct golden_precomputed all;
static struct program plain;
static struct chunk whole; /* the program as a job of one chunk */

void setUp(void)
{
}

void tearDown(void)
{
}

static void open(const char *name, enum kernel_number kernel)
{
    golden_open(&plain, name);
    golden_precompute(&all, &plain, kernel);
    whole = (struct chunk){.flags = CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST, .program = plain};
}

static void close(void)
{
    golden_discard(&all);
    golden_close(&plain);
}

/* As small as it may be, and a multiple of that. */
static uint32_t bytes_of(const struct kernel *kernel, uint32_t times)
{
    return 2u * times * COEFFICIENT_CACHE_LEAST *
           (coefficients_piece_size(kernel) +
            coefficients_segment_size(kernel, plain.header.axis_count));
}

static void begin_with_cache(struct motion *m, const struct kernel *kernel, uint32_t bytes)
{
    memset(m, 0, sizeof *m);
    memset(memory, 0xA5, sizeof memory);
    coefficient_cache_init(&cache, (uint8_t *)memory, bytes);
    TEST_ASSERT_TRUE(coefficient_cache_fits(&cache, kernel, plain.header.axis_count));
    const struct coefficients_window *window = coefficient_cache_begin(&cache, &plain, kernel);
    interpolator_begin_window(&m->it, &plain, window);
    feed_override_begin_job(&m->feed, &whole, window, plain.header.period_us);
}

static void begin_with_all(struct motion *m)
{
    memset(m, 0, sizeof *m);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&m->it, &all.program));
    feed_override_begin_job(&m->feed, &whole, &m->it.window, plain.header.period_us);
}

static void make_records(struct motion *m)
{
    struct feed_place place;
    feed_override_place(&m->feed, &m->it, &place);
    const struct coefficients_window *window = coefficient_cache_prepare(&cache, &plain, &place);
    if (window != NULL) {
        TEST_ASSERT_EQUAL_INT(1, feed_override_use(&m->feed, &m->it, window));
        coefficient_cache_used(&cache);
        memset(cache.half[1u - cache.used].memory, 0xA5, cache.size); /* nobody reads there */
    }
}

static void command(struct motion *a, struct motion *b, uint64_t *random)
{
    const uint64_t kind = golden_random(random) % 8u;
    const uint32_t percent = (uint32_t)(golden_random(random) % 201u);
    struct motion *const both[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        if (kind < 2) {
            feed_override_hold(&both[i]->feed);
        } else if (kind < 5) {
            feed_override_resume(&both[i]->feed);
        } else {
            feed_override_set(&both[i]->feed, percent);
        }
    }
}

static void same_motion(const struct kernel *kernel, uint32_t bytes, uint64_t *random)
{
    struct motion a, b;
    begin_with_cache(&a, kernel, bytes);
    begin_with_all(&b);
    for (uint32_t k = 0; k < 3000u && feed_override_state(&b.feed) != FEED_ENDED; k++) {
        if (golden_random(random) % 64u == 0) {
            command(&a, &b, random);
        }
        make_records(&a);
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&a.feed, &a.it, &a.point));
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&b.feed, &b.it, &b.point));
        TEST_ASSERT_EQUAL_MEMORY(&b.point, &a.point, sizeof a.point);
        TEST_ASSERT_EQUAL_INT(feed_override_state(&b.feed), feed_override_state(&a.feed));
    }
}

static void test_setpoints_do_not_depend_on_the_cache(void)
{
    uint64_t random = 7;
    for (size_t i = 0; i < NAME_COUNT; i++) {
        for (int number = KERNEL_FIXED; number <= KERNEL_DOUBLE; number++) {
            const struct kernel *kernel = kernel_find((uint32_t)number);
            open(NAMES[i], (enum kernel_number)number);
            for (uint32_t times = 1; times <= 4u; times++) {
                same_motion(kernel, bytes_of(kernel, times) + 8u * (times % 2u), &random);
            }
            close();
        }
    }
}

/* Records in a window are those of the whole but for their links. */
static void test_records_of_a_window(void)
{
    const struct kernel *kernel = kernel_find(KERNEL_FIXED);
    open("star_minimax.hdgp", KERNEL_FIXED);
    struct motion m;
    begin_with_cache(&m, kernel, bytes_of(kernel, 2));
    const struct feed_place place = {.piece = 9, .segment = 3};
    const struct coefficients_window *w = coefficient_cache_prepare(&cache, &plain, &place);
    TEST_ASSERT_NOT_NULL(w);
    TEST_ASSERT_EQUAL_UINT32(9, w->first_piece);
    TEST_ASSERT_EQUAL_UINT32(2, w->first_segment); /* one before */
    TEST_ASSERT_TRUE(w->piece_count >= 3u && w->segment_count >= 3u);
    TEST_ASSERT_NULL(coefficients_window_piece(w, 8));
    TEST_ASSERT_NULL(coefficients_window_piece(w, 9u + w->piece_count));
    TEST_ASSERT_NULL(coefficients_window_segment(w, 1));
    const struct coefficients_piece *piece = coefficients_window_piece(w, 9);
    for (uint32_t i = 9; i < 9u + w->piece_count; i++) {
        struct coefficients_piece right = *coefficients_piece_at(&all.program, kernel, i);
        const int last = i + 1u == 9u + w->piece_count;
        TEST_ASSERT_EQUAL_PTR(coefficients_window_piece(w, i), piece);
        right.next = last ? 0 : (int32_t)coefficients_piece_size(kernel);
        TEST_ASSERT_EQUAL_MEMORY(&right, piece, coefficients_piece_size(kernel));
        piece = coefficients_piece_next(piece);
    }
    const struct coefficients_segment *segment = coefficients_window_segment(w, 2);
    TEST_ASSERT_EQUAL_INT(0, segment->back);
    for (uint32_t i = 2; i < 2u + w->segment_count; i++) {
        const struct coefficients_segment *right = coefficients_segment_at(&all.program, kernel, i);
        TEST_ASSERT_EQUAL_PTR(coefficients_window_segment(w, i), segment);
        TEST_ASSERT_EQUAL_UINT32(i, segment->number);
        TEST_ASSERT_EQUAL_MEMORY(&right->path, &segment->path,
                                 kernel_path(kernel, PROGRAM_PLANE)->segment_size);
        TEST_ASSERT_TRUE(i == 2u ||
                         coefficients_segment_next(coefficients_segment_back(segment)) == segment);
        segment = coefficients_segment_next(segment);
    }
    close();
}

/* The main loop stalls: setpoints continue to the end of the window, then there is none. */
static void test_a_record_that_is_not_there_refuses_the_tick(void)
{
    const struct kernel *kernel = kernel_find(KERNEL_FIXED);
    for (uint32_t times = 1; times <= 3u; times++) {
        struct motion m, right;
        int result = 0;
        uint32_t ticks = 0;
        open("star_minimax.hdgp", KERNEL_FIXED);
        begin_with_cache(&m, kernel, bytes_of(kernel, times));
        begin_with_all(&right);
        TEST_ASSERT_TRUE(m.it.window.piece_count < plain.header.piece_count);
        while (result == 0) {
            const struct interpolator_point before = m.point;
            result = feed_override_next(&m.feed, &m.it, &m.point);
            (void)feed_override_next(&right.feed, &right.it, &right.point);
            TEST_ASSERT_EQUAL_MEMORY(result == 0 ? &right.point : &before, &m.point, sizeof before);
            TEST_ASSERT_TRUE(ticks++ < 3000u);
        }
        TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_JUMP, result);
        TEST_ASSERT_TRUE(m.feed.clock.piece < plain.header.piece_count);
        TEST_ASSERT_TRUE(ticks > times * 3u);
        close();
    }
}

/* Before that the motion has requested more records. */
static void test_it_wants_records_in_the_middle_of_the_window(void)
{
    const struct kernel *kernel = kernel_find(KERNEL_FIXED);
    struct motion m;
    open("star_minimax.hdgp", KERNEL_FIXED);
    begin_with_cache(&m, kernel, bytes_of(kernel, 3));
    TEST_ASSERT_EQUAL_INT(0, feed_override_wants_records(&m.feed, &m.it));
    while (!feed_override_wants_records(&m.feed, &m.it)) {
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&m.feed, &m.it, &m.point));
    }
    const struct coefficients_window *w = &m.it.window;
    TEST_ASSERT_TRUE(m.feed.clock.piece <= w->first_piece + w->piece_count / 2u);
    make_records(&m);
    TEST_ASSERT_EQUAL_INT(0, feed_override_wants_records(&m.feed, &m.it));
    begin_with_all(&m);
    while (feed_override_state(&m.feed) != FEED_ENDED) {
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&m.feed, &m.it, &m.point));
        TEST_ASSERT_EQUAL_INT(0, feed_override_wants_records(&m.feed, &m.it));
    }
    close();
}

static void test_a_cache_that_is_too_small(void)
{
    const struct kernel *kernel = kernel_find(KERNEL_FLOAT);
    open("space6.hdgp", KERNEL_FLOAT);
    const uint32_t least = bytes_of(kernel, 1);
    coefficient_cache_init(&cache, (uint8_t *)memory, least - 1u);
    TEST_ASSERT_EQUAL_INT(0, coefficient_cache_fits(&cache, kernel, 6));
    TEST_ASSERT_EQUAL_INT(1, coefficient_cache_fits(&cache, kernel, 2));
    coefficient_cache_init(&cache, NULL, 0);
    TEST_ASSERT_EQUAL_INT(0, coefficient_cache_fits(&cache, kernel, 2));
    close();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_setpoints_do_not_depend_on_the_cache);
    RUN_TEST(test_records_of_a_window);
    RUN_TEST(test_a_record_that_is_not_there_refuses_the_tick);
    RUN_TEST(test_it_wants_records_in_the_middle_of_the_window);
    RUN_TEST(test_a_cache_that_is_too_small);
    return UNITY_END();
}
