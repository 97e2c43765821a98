/* SPDX-License-Identifier: MIT */
/*
 * Chunks of a job: their check, and the takeover of the next one by the motion (core/chunk.h, core/feed_override.h).
 * The chunks are cut from golden programs (chunked.h), so that the whole program gives the right setpoints. Run by
 * `make unit`; reads files of tests/data.
 */
#include <stdlib.h>
#include <string.h>

#include "chunked.h"
#include "core/feed_override.h"
#include "golden.h"
#include "unity.h"

enum { MOST_TICKS = 4000, BEHIND = 60 };
enum { SEQUENCE = 20, PIECE_SHIFT = 24, SHARED_PIECES = 32, SHARED_SEGMENTS = 36, JOB_START = 56 };

static struct override_program whole;
static struct chunked chain;
static struct chunk chunks[CHUNKED_MOST];
static void *records[CHUNKED_MOST];

static void open_whole(const char *name)
{
    uint64_t random = 7;
    override_program_golden(&whole, name);
    chunked_refine(&whole, 0.01);
    override_program_limits(&whole, &random);
    golden_seal(whole.image, whole.program.size);
    memset(records, 0, sizeof records);
}

static void close_whole(void)
{
    for (uint32_t i = 0; i < CHUNKED_MOST; i++) {
        free(records[i]);
    }
    chunked_close(&chain);
    override_program_close(&whole);
}

void setUp(void)
{
    open_whole("alpha_minimax.hdgp");
}

void tearDown(void)
{
    close_whole();
}

static int check_chunk(uint32_t i, struct program_fault *fault)
{
    const struct program_limits limits = golden_no_limits();
    fault->index = 0;
    fault->code = chunk_open(&chunks[i], chain.bytes[i], chain.sizes[i]);
    return fault->code != 0
               ? fault->code
               : chunk_check(&chunks[i], i > 0 ? &chunks[i - 1u] : NULL, &limits, fault);
}

/* All chunks of the chain opened, checked, and made ready for a kernel. */
static void accept_all(enum kernel_number number)
{
    const struct kernel *kernel = kernel_find((uint32_t)number);
    for (uint32_t i = 0; i < chain.count; i++) {
        struct program_fault fault;
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, check_chunk(i, &fault), program_error_text(fault.code));
        const uint64_t size = coefficients_size(&chunks[i].program, kernel);
        free(records[i]);
        records[i] = malloc((size_t)size);
        TEST_ASSERT_EQUAL_INT(0,
                              coefficients_make_in(&chunks[i].program, kernel, records[i], size));
    }
}

/* Two chunks: pieces before 40, with those from 12 on in both. */
static void cut_in_two(void)
{
    const uint32_t firsts[2] = {0, 12};
    const uint32_t joints[2] = {40, whole.program.header.piece_count};
    TEST_ASSERT_TRUE(chunked_make(&chain, &whole, firsts, joints, 2));
}

static void put(uint8_t *at, uint64_t value)
{
    for (uint32_t i = 0; i < 8u; i++) {
        at[i] = (uint8_t)(value >> 8u * i);
    }
}

/* --- The check --- */

static int code_with(uint32_t at, uint32_t value, uint32_t bytes)
{
    struct program_fault fault;
    uint8_t *chunk = chain.bytes[1];
    uint8_t before[4];
    memcpy(before, chunk + at, bytes);
    for (uint32_t i = 0; i < bytes; i++) {
        chunk[at + i] = (uint8_t)(value >> (8u * i));
    }
    chunked_seal(chain.bytes[1], chain.sizes[1]);
    const int code = check_chunk(1, &fault);
    memcpy(chunk + at, before, bytes);
    chunked_seal(chain.bytes[1], chain.sizes[1]);
    return code;
}

static void test_headers_are_refused_with_their_codes(void)
{
    struct program_fault fault;
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, code_with(0, 'h', 1));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, code_with(4, CHUNK_VERSION + 1u, 2));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, code_with(6, 16, 2));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, code_with(72, 1, 1));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, code_with(76, 1, 1));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT,
                          code_with(6, CHUNK_FLAG_JOINED | CHUNK_FLAG_LAST, 2));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_REST,
                          code_with(6, CHUNK_FLAG_REST | CHUNK_FLAG_LAST, 2));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_JOB, code_with(16, 0, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_JOB, code_with(16, 99, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SEQUENCE, code_with(SEQUENCE, 0, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SEQUENCE, code_with(SEQUENCE, 2, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FIRST,
                          code_with(6, CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST, 2));
    for (uint32_t at = PIECE_SHIFT; at < 64; at += 4) { /* every shift and shared count */
        const uint32_t was = (uint32_t)chain.bytes[1][at];
        if (at != SHARED_PIECES) { /* fewer pieces than could be are shared: allowed */
            TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SHARED, code_with(at, was ^ 1u, 1));
        }
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SHARED, code_with(at, 0xFFFFFFFFu, 4));
    }
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SHARED, code_with(SHARED_PIECES, 0, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SHARED, code_with(SHARED_SEGMENTS, 0, 4));
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
}

/* Truncated at any byte, and any flipped bit. */
static void test_damage_is_refused(void)
{
    struct program_fault fault;
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    for (uint32_t size = 0; size < chain.sizes[1]; size += 7) {
        TEST_ASSERT_TRUE(chunk_open(&chunks[1], chain.bytes[1], size) < 0);
    }
    for (uint32_t bit = 0; bit < 8u * chain.sizes[1]; bit += 11) {
        chain.bytes[1][bit / 8u] ^= (uint8_t)(1u << bit % 8u);
        TEST_ASSERT_TRUE(chunk_open(&chunks[1], chain.bytes[1], chain.sizes[1]) < 0);
        chain.bytes[1][bit / 8u] ^= (uint8_t)(1u << bit % 8u);
    }
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
}

/* Records of the image of chunk 1: where they begin, and bytes of each. */
struct layout {
    uint32_t segments_at, segment_size;
    uint32_t pieces_at, piece_size;
};

static struct layout layout_of_next(void)
{
    const struct program_header *h = &chunks[1].program.header;
    const int compact = (h->flags & PROGRAM_FLAG_COMPACT) != 0;
    struct layout r = {
        .segments_at = CHUNK_HEADER_SIZE + h->header_size,
        .segment_size = compact ? program_compact_segment_size(h->axis_count)
                                : program_segment_size(h->axis_count),
        .piece_size = compact ? PROGRAM_COMPACT_PIECE_SIZE : PROGRAM_PIECE_SIZE,
    };
    r.pieces_at = r.segments_at + h->segment_count * r.segment_size;
    return r;
}

static struct program_fault fault_with_bit(uint32_t at)
{
    struct program_fault fault;
    uint8_t *sound = malloc(chain.sizes[1]);
    TEST_ASSERT_NOT_NULL(sound);
    memcpy(sound, chain.bytes[1], chain.sizes[1]);
    chain.bytes[1][at] ^= 1u;
    chunked_seal(chain.bytes[1], chain.sizes[1]);
    (void)check_chunk(1, &fault);
    memcpy(chain.bytes[1], sound, chain.sizes[1]);
    free(sound);
    return fault;
}

/* A changed bit of any byte of the shared records is found, and named with its record. */
static void expect_shared_bytes_compared(void)
{
    struct program_fault fault;
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
    const struct layout r = layout_of_next();
    TEST_ASSERT_TRUE(chunks[1].shared_segments > 0u && chunks[1].shared_pieces > 0u);
    for (uint32_t at = 0; at < chunks[1].shared_segments * r.segment_size; at++) {
        fault = fault_with_bit(r.segments_at + at);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_SEGMENT, fault.code);
        TEST_ASSERT_EQUAL_UINT32(at / r.segment_size, fault.index);
    }
    for (uint32_t at = 0; at < chunks[1].shared_pieces * r.piece_size; at++) {
        fault = fault_with_bit(r.pieces_at + at);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_PIECE, fault.code);
        TEST_ASSERT_EQUAL_UINT32(at / r.piece_size, fault.index);
    }
}

static void test_any_byte_of_the_shared_part_is_compared(void)
{
    cut_in_two();
    expect_shared_bytes_compared();
    TEST_ASSERT_TRUE(chunks[1].shared_segments > 1u && chunks[1].shared_pieces == 28u);
    const struct layout r = layout_of_next();
    const struct program_fault fault = /* after the joint: the rules of a program */
        fault_with_bit(r.pieces_at + chunks[1].shared_pieces * r.piece_size + 17u);
    TEST_ASSERT_TRUE(fault.code > PROGRAM_ERR_CHUNK_FORMAT && fault.code < 0);
}

/* Whether the predecessor is compact or not. */
static void test_compact_chunks_are_compared_too(void)
{
    cut_in_two();
    TEST_ASSERT_TRUE(chunked_make_compact(&chain, 1));
    expect_shared_bytes_compared();
    TEST_ASSERT_TRUE(chunked_make_compact(&chain, 0));
    expect_shared_bytes_compared();
}

/* The fields that a planar program does not have. */
static void test_chunks_with_six_axes_are_compared_too(void)
{
    close_whole();
    open_whole("space6.hdgp");
    cut_in_two();
    expect_shared_bytes_compared();
    TEST_ASSERT_TRUE(chunked_make_compact(&chain, 1));
    expect_shared_bytes_compared();
}

/* --- The start at rest --- */

/* Chunk 1 as one that begins at rest at the end of chunk 0, but for its points. */
static void begin_next_at_rest(void)
{
    uint8_t *bytes = chain.bytes[1];
    memset(bytes + PIECE_SHIFT, 0, JOB_START - PIECE_SHIFT);
    bytes[6] = CHUNK_FLAG_REST | CHUNK_FLAG_LAST;
    bytes[CHUNK_HEADER_SIZE + 28] = 0;
    put(bytes + JOB_START, (uint64_t)chunks[0].program.header.length_q40_mm);
}

/* The code where segment 0 of chunk 1 begins so far from the end of chunk 0 in one coordinate, of all others 0. */
static int code_with_start(uint32_t axis, uint64_t off_q40)
{
    struct program_fault fault;
    const uint32_t axis_count = chunks[0].program.header.axis_count;
    uint8_t *segment = chain.bytes[1] + CHUNK_HEADER_SIZE + chunks[0].program.header.header_size;
    for (uint32_t i = 0; i < axis_count; i++) {
        const uint32_t at = i < program_curve_axes(axis_count)
                                ? 8u + 8u * i
                                : PROGRAM_SPACE_SIZE + PROGRAM_EXTRA_SIZE * (i - PROGRAM_SPACE);
        const uint64_t end_q40 = (uint64_t)chunks[0].end.position_q40[i];
        put(segment + at, end_q40 + (i == axis ? off_q40 : 0u));
    }
    chunked_seal(chain.bytes[1], chain.sizes[1]);
    return check_chunk(1, &fault);
}

/* A point up to 2^-24 mm off is accepted: what is wrong then are the pieces, which begin in motion. */
static void expect_start_compared(void)
{
    const uint64_t most_q40 = (uint64_t)1 << 16;
    struct program_fault fault;
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    begin_next_at_rest();
    for (uint32_t axis = 0; axis < chunks[0].program.header.axis_count; axis++) {
        const uint64_t end_q40 = (uint64_t)chunks[0].end.position_q40[axis];
        const uint64_t far[] = {most_q40 + 1u, 0u - most_q40 - 1u, (uint64_t)INT64_MIN - end_q40,
                                (uint64_t)INT64_MAX - end_q40, (uint64_t)1 << 63};
        const uint64_t near[] = {0u, most_q40, 0u - most_q40};
        for (uint32_t i = 0; i < sizeof far / sizeof *far; i++) {
            TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_REST, code_with_start(axis, far[i]));
        }
        for (uint32_t i = 0; i < sizeof near / sizeof *near; i++) {
            const int code = code_with_start(axis, near[i]);
            TEST_ASSERT_TRUE(code < 0 && code != PROGRAM_ERR_CHUNK_REST);
        }
    }
}

/* Any number may stand in the place of a coordinate. */
static void test_a_chunk_at_rest_begins_where_its_predecessor_ends(void)
{
    expect_start_compared();
    close_whole();
    open_whole("space6.hdgp");
    expect_start_compared();
}

/* --- Events --- */

static void with_events(uint32_t count)
{
    uint64_t random = 3;
    chunked_add_events(&whole, count, &random);
    golden_seal(whole.image, whole.program.size);
}

static uint32_t event_at(uint32_t i)
{
    return chain.sizes[1] - (chunks[1].program.header.event_count - i) * PROGRAM_EVENT_SIZE;
}

static uint32_t shared_events(void)
{
    const struct program *before = &chunks[0].program;
    return before->header.event_count -
           program_first_event_from(before, chunks[1].arc_shift_q40_mm);
}

/* Any bit of those on the shared segments; one after them is an event of the next chunk alone. */
static void test_events_of_the_shared_part_are_the_predecessors(void)
{
    struct program_fault fault;
    with_events(40);
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, check_chunk(1, &fault), program_error_text(fault.code));
    const uint32_t shared = shared_events();
    const uint32_t count = chunks[1].program.header.event_count;
    TEST_ASSERT_TRUE(shared > 4u && count > shared + 4u);
    for (uint32_t at = event_at(0); at < event_at(shared); at++) {
        const struct program_fault found = fault_with_bit(at);
        TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_EVENT, found.code);
        TEST_ASSERT_EQUAL_UINT32((at - event_at(0)) / PROGRAM_EVENT_SIZE, found.index);
    }
    TEST_ASSERT_EQUAL_INT(0, fault_with_bit(event_at(count - 1u) + 12).code);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_EVENT_PLACE, fault_with_bit(event_at(count - 1u) + 7).code);
}

/* The event is taken out of, or put once more into, the image of a chunk. */
static void change_events(uint32_t chunk, uint32_t i, int more)
{
    const uint32_t count = chunks[chunk].program.header.event_count;
    const uint32_t size = chain.sizes[chunk] + PROGRAM_EVENT_SIZE;
    uint8_t *bytes = calloc(1, size);
    const uint32_t at = chain.sizes[chunk] - (count - i) * PROGRAM_EVENT_SIZE;
    const uint32_t from = more ? at : at + PROGRAM_EVENT_SIZE;
    const uint32_t to = more ? at + PROGRAM_EVENT_SIZE : at;
    TEST_ASSERT_NOT_NULL(bytes);
    memcpy(bytes, chain.bytes[chunk], chain.sizes[chunk]);
    memcpy(bytes + to, chain.bytes[chunk] + from, chain.sizes[chunk] - from);
    free(chain.bytes[chunk]);
    chain.bytes[chunk] = bytes;
    chain.sizes[chunk] = to + chain.sizes[chunk] - from;
    const uint32_t changed = more ? count + 1u : count - 1u;
    for (uint32_t k = 0; k < 4u; k++) {
        bytes[8 + k] = (uint8_t)(chain.sizes[chunk] >> 8u * k);
        bytes[CHUNK_HEADER_SIZE + 8 + k] =
            (uint8_t)((chain.sizes[chunk] - CHUNK_HEADER_SIZE) >> 8u * k);
        bytes[CHUNK_HEADER_SIZE + 76 + k] = (uint8_t)(changed >> 8u * k);
    }
    chunked_seal(bytes, chain.sizes[chunk]);
}

static void test_one_event_more_or_less_is_refused(void)
{
    struct program_fault fault;
    with_events(40);
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
    const uint32_t shared = shared_events();
    for (uint32_t chunk = 0; chunk < 2u; chunk++) {
        const uint32_t count = chunks[chunk].program.header.event_count;
        const uint32_t first = chunk == 0 ? count - shared : 0u;
        for (uint32_t i = first; i < first + shared; i++) {
            for (int more = 0; more <= 1; more++) {
                change_events(chunk, i, more);
                TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
                TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_EVENT, check_chunk(1, &fault));
                chunked_close(&chain);
                cut_in_two();
                TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
                TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
            }
        }
    }
    chunked_close(&chain);
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, check_chunk(0, &fault));
    change_events(1, shared,
                  0); /* the first one after the predecessor's end: nothing to compare with */
    TEST_ASSERT_EQUAL_INT(0, check_chunk(1, &fault));
}

static void test_a_program_in_motion_is_accepted_in_a_chunk_only(void)
{
    struct program_fault fault;
    struct program_limits limits = golden_no_limits();
    cut_in_two();
    accept_all(KERNEL_FIXED);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_FLAGS, program_check(&chunks[1].program, &limits, &fault));
    limits.chunk = 1;
    TEST_ASSERT_EQUAL_INT(0, program_check(&chunks[1].program, &limits, &fault));
    chain.bytes[1][CHUNK_HEADER_SIZE + 28] = 0; /* not said to move */
    chunked_seal(chain.bytes[1], chain.sizes[1]);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_PIECE_FIRST, check_chunk(1, &fault));
    chain.bytes[0][CHUNK_HEADER_SIZE + 28] = PROGRAM_FLAG_MOVING; /* the first one may not */
    chunked_seal(chain.bytes[0], chain.sizes[0]);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FIRST, check_chunk(0, &fault));
}

static int code_with_first_axes(uint8_t first, uint8_t next)
{
    struct program_fault fault;
    const uint8_t axes[2] = {first, next};
    for (uint32_t i = 0; i < 2; i++) {
        chain.bytes[i][CHUNK_HEADER_SIZE + 29] = axes[i];
        chunked_seal(chain.bytes[i], chain.sizes[i]);
    }
    const int code = check_chunk(0, &fault);
    return code != 0 ? code : check_chunk(1, &fault);
}

static void test_all_chunks_of_a_job_have_one_first_axis(void)
{
    cut_in_two();
    TEST_ASSERT_EQUAL_INT(0, code_with_first_axes(0, 0));
    TEST_ASSERT_EQUAL_INT(0, code_with_first_axes(2, 2));
    TEST_ASSERT_EQUAL_INT(0, code_with_first_axes(4, 4));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_PROGRAM, code_with_first_axes(0, 2));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_PROGRAM, code_with_first_axes(2, 3));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_PROGRAM, code_with_first_axes(2, 0));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_AXES, code_with_first_axes(5, 5));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_FLAGS, code_with_first_axes(8, 8));
}

/* --- The motion --- */

struct motion {
    struct feed_override feed;
    struct interpolator it;
    struct interpolator_point point; /* of the last setpoint, arc length of the job */
    uint32_t chunk;
};

static struct interpolator_point right[MOST_TICKS]; /* setpoints of the whole program */
static uint32_t right_count;
static struct golden_precomputed exact;

static void run_whole(enum kernel_number kernel, uint32_t percent)
{
    struct feed_override feed;
    struct interpolator it;
    golden_precompute(&exact, &whole.program, kernel);
    feed_override_begin(&feed, &exact.program, whole.program.header.period_us, 0);
    feed_override_set(&feed, percent);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &exact.program));
    right_count = 0;
    while (feed_override_state(&feed) != FEED_ENDED) {
        TEST_ASSERT_TRUE(right_count < MOST_TICKS);
        memset(&right[right_count], 0, sizeof right[0]);
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&feed, &it, &right[right_count++]));
    }
    golden_discard(&exact);
}

static void begin(struct motion *m)
{
    memset(m, 0, sizeof *m);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&m->it, &chunks[0].program));
    feed_override_begin_job(&m->feed, &chunks[0], &m->it.window, whole.program.header.period_us);
}

static void tick(struct motion *m)
{
    TEST_ASSERT_EQUAL_INT(0, feed_override_next(&m->feed, &m->it, &m->point));
    m->point.arc_length_q40_mm += chunks[m->chunk].job_start_q40_mm;
}

static int take_over(struct motion *m)
{
    const struct motion before = *m;
    struct coefficients_window window;
    coefficients_window_of(&window, &chunks[m->chunk + 1u].program);
    if (feed_override_take_over(&m->feed, &m->it, &chunks[m->chunk + 1u], &window)) {
        m->chunk++;
        return 1;
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, m, sizeof before); /* nothing has changed */
    return 0;
}

static void same_setpoints(struct motion *m, uint32_t from, uint32_t to)
{
    for (uint32_t k = from; k < to && k < right_count; k++) {
        tick(m);
        TEST_ASSERT_EQUAL_MEMORY(&right[k], &m->point, sizeof m->point);
    }
}

static int passed_joint(const struct motion *m, const struct chunk *next)
{
    return m->feed.clock.piece >= next->piece_shift + next->shared_pieces;
}

/* Takes chunk 1 over at every tick in which that is possible, and compares all setpoints with those of the whole. */
static void take_over_at_every_tick(enum kernel_number kernel, uint32_t percent)
{
    struct motion m;
    uint32_t taken = 0;
    accept_all(kernel);
    run_whole(kernel, percent);
    begin(&m);
    feed_override_set(&m.feed, percent);
    for (uint32_t k = 0; k + 1u < right_count; k++) {
        tick(&m);
        if (passed_joint(&m, &chunks[1])) {
            break;
        }
        TEST_ASSERT_EQUAL_MEMORY(&right[k], &m.point, sizeof m.point);
        struct motion branch = m;
        if (take_over(&branch)) {
            taken++;
            same_setpoints(&branch, k + 1u, taken % 16u == 0u ? right_count : k + BEHIND);
        } else { /* before the shared part only */
            TEST_ASSERT_EQUAL_UINT32(0, taken);
        }
    }
    TEST_ASSERT_FALSE(take_over(&m));
    TEST_ASSERT_TRUE(taken > 100u);
}

static void test_a_takeover_at_every_tick_changes_no_setpoint(void)
{
    cut_in_two();
    for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
        take_over_at_every_tick((enum kernel_number)kernel, 100);
    }
    take_over_at_every_tick(KERNEL_FIXED, 37);
}

/* Many chunks, each taken over at the first or the last tick that there is. */
static void run_chain(uint32_t late)
{
    struct motion m;
    run_whole(KERNEL_FIXED, 100);
    begin(&m);
    for (uint32_t k = 0; k < right_count; k++) {
        same_setpoints(&m, k, k + 1u);
        if (m.chunk + 1u < chain.count) {
            const struct chunk *next = &chunks[m.chunk + 1u];
            struct motion ahead = m;
            tick(&ahead);
            if (late == 0u || passed_joint(&ahead, next)) {
                (void)take_over(&m);
            }
        }
    }
    TEST_ASSERT_EQUAL_UINT32(chain.count - 1u, m.chunk);
    TEST_ASSERT_EQUAL_INT(FEED_ENDED, feed_override_state(&m.feed));
}

static void test_chains_give_the_setpoints_of_the_whole(void)
{
    uint64_t random = 5;
    uint32_t most = 0;
    for (int i = 0; i < 40; i++) {
        TEST_ASSERT_TRUE(chunked_random(&chain, &whole, &random));
        most = chain.count > most ? chain.count : most;
        accept_all(KERNEL_FIXED);
        run_chain(0);
        run_chain(1);
        chunked_close(&chain);
    }
    TEST_ASSERT_TRUE(most > 8u);
}

static void run_to_piece(struct motion *m, uint32_t piece)
{
    while (m->feed.clock.piece < piece) {
        tick(m);
    }
}

/* In motion with a brake, a command that waits for one, or a search of the override: not now. */
static void test_no_takeover_while_a_stop_or_a_search_is_under_way(void)
{
    struct motion m;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    for (int kind = 0; kind < 3; kind++) {
        begin(&m);
        run_to_piece(&m, 20);
        kind == 0   ? feed_override_hold(&m.feed)
        : kind == 1 ? feed_override_stop(&m.feed)
                    : feed_override_fault_stop(&m.feed);
        while (feed_override_state(&m.feed) != FEED_HELD &&
               feed_override_state(&m.feed) != FEED_STOPPED) {
            TEST_ASSERT_FALSE(take_over(&m));
            tick(&m);
        }
        TEST_ASSERT_EQUAL_INT(kind == 0, take_over(&m)); /* a stop is final */
    }
    begin(&m);
    TEST_ASSERT_FALSE(take_over(&m)); /* nothing has moved yet */
    run_to_piece(&m, 20);
    feed_override_set(&m.feed, 50);
    TEST_ASSERT_FALSE(take_over(&m));
    tick(&m);
    TEST_ASSERT_FALSE(take_over(&m)); /* a window is evaluated */
}

/* In a ramp: a takeover gives the setpoints that this chunk would have had, and only where the ramp ends before the
 * joint. Returns 0 where it is refused. */
static int goes_on_in_ramp(const struct motion *m)
{
    struct motion branch = *m;
    struct motion same = *m;
    if (!take_over(&branch)) {
        return 0;
    }
    while (override_ramp_moves(&same.feed.plan.ramp)) {
        tick(&same);
        tick(&branch);
        TEST_ASSERT_EQUAL_MEMORY(&same.point, &branch.point, sizeof m->point);
        TEST_ASSERT_FALSE(passed_joint(&same, &chunks[1]));
    }
    return 1;
}

/* Takeovers are tried in each tick of a ramp that begins at a piece: how many are accepted, and how many are not. */
static void try_in_ramp(uint32_t piece, uint32_t percent, uint32_t *accepted, uint32_t *refused)
{
    struct motion m;
    *accepted = *refused = 0;
    begin(&m);
    run_to_piece(&m, piece);
    feed_override_set(&m.feed, percent);
    while (!passed_joint(&m, &chunks[1])) {
        tick(&m);
        if (override_ramp_moves(&m.feed.plan.ramp)) {
            *(goes_on_in_ramp(&m) ? accepted : refused) += 1;
        }
    }
}

static void test_ramps(void)
{
    uint32_t accepted;
    uint32_t refused;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    try_in_ramp(14, 95, &accepted, &refused);
    TEST_ASSERT_TRUE(accepted > 0u);
    try_in_ramp(37, 10, &accepted, &refused); /* too near to the joint for a ramp to 10 % */
    TEST_ASSERT_TRUE(refused > 0u);
}

/* --- At rest --- */

/* The setpoint is on the path of the whole program, at its arc length, and has not gone back. */
static void on_the_path(const struct motion *m, int64_t *last_q40, struct interpolator *path)
{
    struct interpolator_point at;
    const int64_t arc = m->point.arc_length_q40_mm;
    TEST_ASSERT_TRUE(arc >= *last_q40 - 4);
    *last_q40 = arc;
    while (interpolator_at_arc_length(path, arc, &at) < 0) {
        (void)interpolator_at_arc_length(path, path->segment->to_q40_mm, &at);
    }
    for (int axis = 0; axis < 2; axis++) {
        TEST_ASSERT_TRUE(llabs(at.position_q40[axis] - m->point.position_q40[axis]) < 2200000);
    }
}

static void run_on(struct motion *m, uint32_t ticks, int64_t *last_q40, struct interpolator *path)
{
    for (uint32_t k = 0; k < ticks && feed_override_state(&m->feed) != FEED_ENDED; k++) {
        tick(m);
        on_the_path(m, last_q40, path);
    }
}

static void test_the_tail_ends_at_rest_and_the_motion_goes_on_from_there(void)
{
    struct motion m;
    struct interpolator path;
    int64_t last_q40 = 0;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    golden_precompute(&exact, &whole.program, KERNEL_DOUBLE);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&path, &exact.program));
    begin(&m);
    while (!feed_override_waits(&m.feed)) {
        run_on(&m, 1, &last_q40, &path);
    }
    TEST_ASSERT_EQUAL_INT(FEED_RUNNING, feed_override_state(&m.feed));
    TEST_ASSERT_EQUAL_UINT32(0, feed_override_actual_q30(&m.feed));
    TEST_ASSERT_TRUE(feed_override_feed_q32(&m.feed) == 0);
    TEST_ASSERT_TRUE(m.point.arc_length_q40_mm == chunks[0].program.header.length_q40_mm);
    run_on(&m, 100, &last_q40, &path);
    TEST_ASSERT_TRUE(take_over(&m));
    TEST_ASSERT_FALSE(feed_override_waits(&m.feed));
    run_on(&m, MOST_TICKS, &last_q40, &path);
    TEST_ASSERT_EQUAL_INT(FEED_ENDED, feed_override_state(&m.feed));
    TEST_ASSERT_TRUE(m.point.arc_length_q40_mm == whole.program.header.length_q40_mm);
    golden_discard(&exact);
}

/* Commands while it waits at the end of a tail, or moves there. */
static void test_commands_at_the_end_of_a_tail(void)
{
    struct motion m;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    for (uint32_t before = 0; before < 40;
         before++) { /* a hold so many ticks before the end, and at it */
        begin(&m);
        const uint64_t end = chunks[0].program.header.duration_q32_s << 10;
        while (feed_override_time_q42(&m.feed) + before * m.feed.clock.period_q42_s < end &&
               !feed_override_waits(&m.feed)) {
            tick(&m);
        }
        feed_override_hold(&m.feed);
        for (int k = 0; k < 2000 && feed_override_state(&m.feed) != FEED_HELD; k++) {
            tick(&m);
        }
        TEST_ASSERT_EQUAL_INT(FEED_HELD, feed_override_state(&m.feed));
        const struct interpolator_point rest = m.point;
        TEST_ASSERT_TRUE(take_over(&m));
        for (int k = 0; k < 200; k++) { /* still held */
            tick(&m);
            TEST_ASSERT_EQUAL_MEMORY(&rest, &m.point, sizeof rest);
        }
        feed_override_resume(&m.feed);
        for (int k = 0; k < MOST_TICKS && feed_override_state(&m.feed) != FEED_ENDED; k++) {
            tick(&m);
        }
        TEST_ASSERT_EQUAL_INT(FEED_ENDED, feed_override_state(&m.feed));
    }
    for (int kind = 0; kind < 2; kind++) {
        begin(&m);
        while (!feed_override_waits(&m.feed)) {
            tick(&m);
        }
        kind == 0 ? feed_override_stop(&m.feed) : feed_override_fault_stop(&m.feed);
        TEST_ASSERT_EQUAL_INT(FEED_STOPPED, feed_override_state(&m.feed));
        TEST_ASSERT_FALSE(take_over(&m));
    }
}

/* Held before the chunk begins: it has to wait until the motion is there. */
static void test_no_takeover_at_rest_before_the_chunk(void)
{
    struct motion m;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    begin(&m);
    run_to_piece(&m, 6);
    feed_override_hold(&m.feed);
    while (feed_override_state(&m.feed) != FEED_HELD) {
        tick(&m);
    }
    TEST_ASSERT_TRUE(m.point.arc_length_q40_mm <
                     chunks[1].job_start_q40_mm + program_piece_start(&chunks[1].program, 0));
    TEST_ASSERT_FALSE(take_over(&m));
    feed_override_resume(&m.feed);
    while (!take_over(&m)) {
        TEST_ASSERT_FALSE(passed_joint(&m, &chunks[1]));
        tick(&m);
    }
}

/* Above 100 % the override counts as 100 % until the last chunk. */
static void test_override_above_100_waits_for_the_last_chunk(void)
{
    struct motion m;
    uint32_t most_q30 = 0;
    cut_in_two();
    accept_all(KERNEL_FIXED);
    run_whole(KERNEL_FIXED, 100);
    begin(&m);
    feed_override_set(&m.feed, 150);
    uint32_t k = 0;
    while (m.feed.clock.piece < 30) {
        same_setpoints(&m, k, k + 1u);
        TEST_ASSERT_TRUE(feed_override_saturated(&m.feed));
        k++;
    }
    TEST_ASSERT_TRUE(take_over(&m));
    while (feed_override_state(&m.feed) != FEED_ENDED) {
        tick(&m);
        const uint32_t now_q30 = feed_override_actual_q30(&m.feed);
        most_q30 = now_q30 > most_q30 ? now_q30 : most_q30;
    }
    TEST_ASSERT_TRUE(most_q30 > 1u << 30);
    TEST_ASSERT_TRUE(m.point.arc_length_q40_mm == whole.program.header.length_q40_mm);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_headers_are_refused_with_their_codes);
    RUN_TEST(test_damage_is_refused);
    RUN_TEST(test_any_byte_of_the_shared_part_is_compared);
    RUN_TEST(test_compact_chunks_are_compared_too);
    RUN_TEST(test_chunks_with_six_axes_are_compared_too);
    RUN_TEST(test_a_chunk_at_rest_begins_where_its_predecessor_ends);
    RUN_TEST(test_events_of_the_shared_part_are_the_predecessors);
    RUN_TEST(test_one_event_more_or_less_is_refused);
    RUN_TEST(test_a_program_in_motion_is_accepted_in_a_chunk_only);
    RUN_TEST(test_all_chunks_of_a_job_have_one_first_axis);
    RUN_TEST(test_a_takeover_at_every_tick_changes_no_setpoint);
    RUN_TEST(test_chains_give_the_setpoints_of_the_whole);
    RUN_TEST(test_no_takeover_while_a_stop_or_a_search_is_under_way);
    RUN_TEST(test_ramps);
    RUN_TEST(test_the_tail_ends_at_rest_and_the_motion_goes_on_from_there);
    RUN_TEST(test_commands_at_the_end_of_a_tail);
    RUN_TEST(test_no_takeover_at_rest_before_the_chunk);
    RUN_TEST(test_override_above_100_waits_for_the_last_chunk);
    return UNITY_END();
}
