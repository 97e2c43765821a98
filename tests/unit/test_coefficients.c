/* SPDX-License-Identifier: MIT */
/* Coefficient records give the bits that the image gives expanded at the place, in any order of times. Run by
 * `make unit`; reads files of tests/data. */
#include "core/coefficients.h"

#include <stdlib.h>
#include <string.h>

#include "core/interpolator.h"
#include "core/override_plan.h"
#include "core/ph_segment.h"
#include "golden.h"
#include "unity.h"

static const char *const names[] = {
    "alpha_exponential.hdgp", "heart_minimax.hdgp", "star_minimax.hdgp", "line_tiny.hdgp",
    "line_slow.hdgp",         "alpha_offset.hdgp",  "space3.hdgp",       "space6.hdgp"};
#define NAMES (sizeof names / sizeof names[0])

struct buffer {
    uint8_t *bytes;
    uint32_t used;
    uint32_t room;
};

static struct program plain, ready;
static struct buffer records;
static uint64_t seed = 3;

void setUp(void)
{
}

void tearDown(void)
{
}

static int append(void *context, const uint8_t *bytes, uint32_t size)
{
    struct buffer *buffer = context;
    if (buffer->used + size > buffer->room) {
        return -7;
    }
    memcpy(buffer->bytes + buffer->used, bytes, size);
    buffer->used += size;
    return 0;
}

static void begin(const char *name, enum kernel_number kernel)
{
    golden_open(&plain, name);
    const struct kernel *made_for = kernel_find((uint32_t)kernel);
    records.room = (uint32_t)coefficients_size(&plain, made_for);
    records.bytes = malloc(records.room);
    records.used = 0;
    TEST_ASSERT_EQUAL_INT(0, coefficients_make(&plain, made_for, append, &records));
    TEST_ASSERT_EQUAL_UINT32(records.room, records.used);
    ready = plain;
    coefficients_attach(&ready, made_for, records.bytes);
}

static void end(void)
{
    free(records.bytes);
    golden_close(&plain);
}

/* The point as the image has it: its piece and its segment are looked for from the first on and expanded. */
static void expand(struct interpolator_point *out, const struct kernel *kernel, uint64_t time_q42_s)
{
    struct coefficients_piece piece;
    struct coefficients_segment segment;
    struct program_piece from;
    struct program_segment g;
    struct ph_segment ph;
    struct feed_point f;
    uint64_t start_q42_s = 0;
    uint32_t i = 0;
    for (program_piece_get(&plain, 0, &from); time_q42_s - start_q42_s >= from.duration_q32_s << 10;
         program_piece_get(&plain, ++i, &from)) {
        start_q42_s += from.duration_q32_s << 10;
    }
    kernel->piece_set(&piece.feed, &from);
    kernel->piece_at(&piece.feed, &f, time_q42_s - start_q42_s);
    const int64_t least = f.arc_length_q40_mm < 0 ? 0 : f.arc_length_q40_mm;
    const int64_t arc = least > plain.header.length_q40_mm ? plain.header.length_q40_mm : least;
    for (i = plain.header.segment_count - 1u; i > 0 && program_segment_start(&plain, i) > arc;
         i--) {
    }
    program_segment_get(&plain, i, &g);
    ph_segment_expand(&ph, &g);
    kernel_path(kernel, g.axis_count)->segment_set(&segment.path, &ph);
    kernel_path(kernel, g.axis_count)->segment_at(&segment.path, out->position_q40, arc);
    out->arc_length_q40_mm = arc;
    out->feed_q32_mm_s = f.feed_q32_mm_s;
}

static void is_as_expanded(struct interpolator *it, uint64_t time_q42_s)
{
    struct interpolator_point p = {0}, q = {0};
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at_q42(it, time_q42_s, &p));
    expand(&q, it->kernel, time_q42_s);
    TEST_ASSERT_EQUAL_MEMORY(&p, &q, sizeof p);
}

static void run(void)
{
    const uint64_t period = (uint64_t)plain.header.period_us * 4398046u;
    const uint64_t duration = plain.header.duration_q32_s << 10;
    struct interpolator it;
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &ready));
    for (uint64_t time = 0; time < duration; time += 1u + golden_random(&seed) % (2u * period)) {
        is_as_expanded(&it, time);
    }
    for (int i = 0; i < 300 && duration > 0; i++) {
        const uint64_t time = golden_random(&seed) % duration;
        interpolator_seek(&it, time >> 10);
        is_as_expanded(&it, time);
    }
}

static void test_same_bits_as_expanded(void)
{
    for (size_t i = 0; i < NAMES; i++) {
        for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
            begin(names[i], (enum kernel_number)kernel);
            run();
            end();
        }
    }
}

/* What a tick of the controller does: the piece is looked for by the program clock only. */
static void test_the_piece_of_the_clock_is_the_one(void)
{
    for (size_t i = 0; i < NAMES; i++) {
        struct program_clock clock;
        struct override_plan plan;
        struct interpolator a, b;
        struct interpolator_point p, q;
        begin(names[i], KERNEL_FIXED);
        TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&a, &ready));
        TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&b, &ready));
        program_clock_begin(&clock, &ready, ready.header.period_us, 0);
        override_plan_begin(&plan, &ready);
        override_plan_set(&plan, 200);
        for (int result = INTERPOLATOR_OK; result == INTERPOLATOR_OK;) {
            const uint64_t time_q42_s = override_plan_tick(&plan, &clock);
            memset(&p, 0, sizeof p);
            memset(&q, 0, sizeof q);
            result = interpolator_at_q42(&a, time_q42_s, &p);
            TEST_ASSERT_EQUAL_INT(result, interpolator_at_piece(&b, clock.record, time_q42_s, &q));
            TEST_ASSERT_EQUAL_MEMORY(&p, &q, sizeof p);
        }
        TEST_ASSERT_EQUAL_UINT64(clock.duration_q42_s, clock.time_q42_s);
        end();
    }
}

/* An image that program_check would refuse: pieces so short that a tick crosses more ends than it may. */
static void test_a_tick_that_crosses_three_ends_is_refused(void)
{
    for (uint64_t ends = 2; ends <= 3; ends++) {
        struct program_clock clock;
        struct override_plan plan;
        struct interpolator it;
        struct interpolator_point point, before;
        begin("alpha_exponential.hdgp", KERNEL_FIXED);
        const uint64_t tick_q32_s = (uint64_t)ready.header.period_us * 4294967296u / 1000000u;
        struct coefficients_piece *piece = (void *)records.bytes;
        for (uint64_t k = 1; k <= ends; k++) { /* all between the second tick and the third */
            const uint64_t end_q42_s = (tick_q32_s + tick_q32_s * k / (ends + 1u)) << 10;
            piece->end_q42_s = end_q42_s;
            piece = (void *)((uint8_t *)piece + coefficients_piece_size(ready.coefficients_for));
            piece->start_q42_s = end_q42_s;
        }
        TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &ready));
        program_clock_begin(&clock, &ready, ready.header.period_us, 0);
        override_plan_begin(&plan, &ready);
        for (int k = 0; k < 2; k++) {
            const uint64_t time_q42_s = override_plan_tick(&plan, &clock);
            TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK,
                                  interpolator_at_piece(&it, clock.record, time_q42_s, &point));
        }
        memcpy(&before, &point, sizeof point);
        const uint64_t time_q42_s = override_plan_tick(&plan, &clock);
        const int result = interpolator_at_piece(&it, clock.record, time_q42_s, &point);
        TEST_ASSERT_EQUAL_INT(ends == 2 ? INTERPOLATOR_OK : INTERPOLATOR_ERR_JUMP, result);
        TEST_ASSERT_EQUAL_INT(ends == 2 ? 1 : 0, memcmp(&before, &point, sizeof point) != 0);
        end();
    }
}

static void test_windows_hold_the_least_of_their_pieces(void)
{
    const struct kernel *fixed = kernel_find(KERNEL_FIXED);
    begin("alpha_exponential.hdgp", KERNEL_FIXED);
    for (uint32_t i = 0; i < plain.header.piece_count; i++) {
        const struct coefficients_piece *piece = coefficients_piece_at(&ready, fixed, i);
        for (uint32_t k = 0; k < OVERRIDE_WINDOWS; k++) {
            struct program_override least;
            memset(&least, 0xFF, sizeof least);
            for (uint32_t j = i; j < i + (1u << k) && j < plain.header.piece_count; j++) {
                struct program_override own;
                program_piece_override(&plain, j, &own);
                least.factor_q14 =
                    own.factor_q14 < least.factor_q14 ? own.factor_q14 : least.factor_q14;
                for (uint32_t n = 0; n < PROGRAM_LEVELS; n++) {
                    least.rate[n] = own.rate[n] < least.rate[n] ? own.rate[n] : least.rate[n];
                    least.second[n] =
                        own.second[n] < least.second[n] ? own.second[n] : least.second[n];
                }
            }
            TEST_ASSERT_EQUAL_MEMORY(&least, &piece->ahead[k], sizeof least);
        }
    }
    end();
}

/* The end of a window is that of its last piece; with the program's last piece there is none. */
static void test_windows_end_with_their_pieces(void)
{
    struct program_clock clock;
    uint64_t start_q32_s = 0;
    begin("alpha_exponential.hdgp", KERNEL_FIXED);
    for (uint32_t i = 0; i < plain.header.piece_count; i++) {
        program_clock_begin(&clock, &ready, ready.header.period_us, start_q32_s << 10);
        TEST_ASSERT_EQUAL_UINT32(i, clock.piece);
        for (uint32_t k = 0; k < OVERRIDE_WINDOWS; k++) {
            struct override_window w;
            uint64_t end_q32_s = start_q32_s;
            const uint32_t behind = i + (1u << k);
            for (uint32_t j = i; j < behind && j < plain.header.piece_count; j++) {
                end_q32_s += program_piece_duration(&plain, j);
            }
            override_window_get(&w, &clock, k);
            TEST_ASSERT_EQUAL_UINT64(behind < plain.header.piece_count ? end_q32_s : UINT64_MAX,
                                     w.end_q32_s);
        }
        start_q32_s += program_piece_duration(&plain, i);
    }
    end();
}

/* In memory: the same records, or a refusal where there is a byte too little. */
static void test_records_in_memory(void)
{
    struct program own;
    begin("alpha_offset.hdgp", KERNEL_FLOAT);
    const struct kernel *kernel = kernel_find(KERNEL_FLOAT);
    uint8_t *memory = malloc(records.used);
    own = plain;
    TEST_ASSERT_EQUAL_INT(COEFFICIENTS_ERR_SIZE,
                          coefficients_make_in(&own, kernel, memory, records.used - 1u));
    TEST_ASSERT_NULL(own.coefficients);
    TEST_ASSERT_EQUAL_INT(0, coefficients_make_in(&own, kernel, memory, records.used));
    TEST_ASSERT_EQUAL_PTR(kernel, own.coefficients_for);
    TEST_ASSERT_EQUAL_PTR(memory, own.coefficients);
    TEST_ASSERT_EQUAL_MEMORY(records.bytes, memory, records.used);
    free(memory);
    end();
}

static void test_an_error_of_the_sink_is_passed_on(void)
{
    begin("alpha_offset.hdgp", KERNEL_FIXED);
    for (uint32_t room = 0; room < records.used; room += 57u) {
        struct buffer small = {records.bytes, 0, room};
        TEST_ASSERT_EQUAL_INT(-7,
                              coefficients_make(&plain, kernel_find(KERNEL_FIXED), append, &small));
    }
    end();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_same_bits_as_expanded);
    RUN_TEST(test_the_piece_of_the_clock_is_the_one);
    RUN_TEST(test_a_tick_that_crosses_three_ends_is_refused);
    RUN_TEST(test_windows_hold_the_least_of_their_pieces);
    RUN_TEST(test_windows_end_with_their_pieces);
    RUN_TEST(test_records_in_memory);
    RUN_TEST(test_an_error_of_the_sink_is_passed_on);
    return UNITY_END();
}
