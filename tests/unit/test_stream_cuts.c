/* SPDX-License-Identifier: MIT */
/*
 * Cuts of a stream at random: chunks that come early, late, twice, damaged or never, while hold, resume, override, stop
 * and fault stop are commanded at any instant. In each tick the setpoint is on the path of the whole program and inside
 * its limits, and goes forward. If no command is given and all chunks are in time, the setpoints equal those of the
 * whole program, bit for bit. Each case ends with a host that sends no more: then the motion comes to rest. Each path
 * event acts once, in the tick whose setpoint reaches it. The records are those of a coefficient cache. The cache size
 * varies from the smallest that works to one that holds whole chunks. With a large cache the main loop is sometimes one
 * tick late.
 *
 * HODOGRAPH_CASES: how many cuts; HODOGRAPH_SEED: another sequence; HODOGRAPH_FIRST: only those from this one on. Run
 * by `make unit`; reads files of tests/data.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "chunked.h"
#include "core/coefficient_cache.h"
#include "core/feed_override.h"
#include "core/path_outputs.h"
#include "golden.h"
#include "unity.h"

#define CASES      10000u
#define WHOLES     12u
#define LINES      4u /* of them: one for each period */
#define IN_SPACE   4u /* more of them: with three axes and with six */
#define SPACE_PART 8u /* one spatial cut for each 8 planar ones */
#define CHAINS     6u /* of each whole program */
#define MOST_TICKS 6000u
#define LONGEST    20000u /* until standstill */
#define CACHE_MOST 131072u
#define EVENTS     40u
#define CACHE_LATE 12288u /* from this size on the main loop may be late */

/* Case found in 10^6 runs: a hold during a rising override ends later than the stop time bound of the piece in which
 * it is commanded. */
#define HOLD_IN_A_RISE 525090u

static const char *const GOLDEN[] = {"alpha_minimax.hdgp", "heart_minimax.hdgp", "line.hdgp",
                                     "alpha_exponential.hdgp"};
static const char *const GOLDEN_IN_SPACE[] = {"space3.hdgp", "space6.hdgp"};

/* The motion with the number of its chunk and of its next setpoint. */
struct motion {
    struct feed_override feed;
    struct interpolator it;
    struct path_outputs outputs;
    uint32_t chunk;
    uint32_t tick;
};

struct chain {
    struct chunked cuts;
    struct chunk chunks[CHUNKED_MOST];
    void *records[CHUNKED_MOST];
    struct motion begun[CHUNKED_MOST]; /* as it was when each chunk was the program */
};

static struct {
    struct golden_precomputed exact;
    struct override_program program;
    struct chain chains[CHAINS];
    struct interpolator_point right[MOST_TICKS]; /* its setpoints at 100 % */
    uint32_t ticks;
    uint32_t chain_count;
} wholes[WHOLES + IN_SPACE];

static struct {
    const struct override_program *p;
    struct chain *chain;
    struct motion m;
    struct interpolator path;
    struct interpolator_point point;
    double h;
    struct override_trace trace;
    uint32_t which;
    uint32_t held;      /* 1: a hold was commanded */
    uint32_t fault;     /* 1: a fault stop */
    uint32_t acted;     /* events at or before the farthest setpoint */
    uint32_t commanded; /* commands so far, */
    uint32_t rested;    /* and rests at the end of a tail */
    unsigned number;
    struct coefficient_cache cache;
    const struct coefficients_window *made; /* a tick ago; NULL: nothing */
    uint32_t late;                          /* 1: the main loop is late by a tick */
} now;

static uint64_t cache_memory[CACHE_MOST / 8u];

static struct {
    uint64_t ticks;
    unsigned moving, resting, underruns, refused, same, ended, stopped, held, waited, windows,
        compact, after_compact;
    double jerk;
} seen;

static char message[160];

void setUp(void)
{
}

void tearDown(void)
{
}

static const char *where(const char *what, double a, double b)
{
    snprintf(message, sizeof message, "case %u tick %u chunk %u: %s: %.12g, %.12g", now.number,
             now.m.tick, now.m.chunk, what, a, b);
    return message;
}

/* The message is written only where the numbers differ: each tick has several checks. */
static void equal(const char *what, int64_t a, int64_t b)
{
    if (a != b) {
        TEST_FAIL_MESSAGE(where(what, (double)a, (double)b));
    }
}

static void at_most(const char *what, double a, double most)
{
    if (!(a <= most)) {
        TEST_FAIL_MESSAGE(where(what, a, most));
    }
}

/* --- Programs and chains --- */

static void run_whole(uint32_t w)
{
    struct golden_precomputed fixed;
    struct feed_override feed;
    struct interpolator it;
    golden_precompute(&fixed, &wholes[w].program.program, KERNEL_FIXED);
    golden_precompute(&wholes[w].exact, &wholes[w].program.program, KERNEL_DOUBLE);
    feed_override_begin(&feed, &fixed.program, fixed.program.header.period_us, 0);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, &fixed.program));
    while (feed_override_state(&feed) != FEED_ENDED) {
        TEST_ASSERT_TRUE(wholes[w].ticks < MOST_TICKS);
        TEST_ASSERT_EQUAL_INT(0,
                              feed_override_next(&feed, &it, &wholes[w].right[wholes[w].ticks++]));
    }
    golden_discard(&fixed);
}

static void accept(struct chain *c)
{
    const struct program_limits limits = golden_no_limits();
    const struct kernel *kernel = kernel_find(KERNEL_FIXED);
    for (uint32_t i = 0; i < c->cuts.count; i++) {
        struct program_fault fault;
        struct chunk *chunk = &c->chunks[i];
        TEST_ASSERT_EQUAL_INT(0, chunk_open(chunk, c->cuts.bytes[i], c->cuts.sizes[i]));
        const int code = chunk_check(chunk, i > 0 ? chunk - 1 : NULL, &limits, &fault);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, code, program_error_text(code));
        const uint64_t size = coefficients_size(&chunk->program, kernel);
        c->records[i] = malloc((size_t)size);
        TEST_ASSERT_EQUAL_INT(0,
                              coefficients_make_in(&chunk->program, kernel, c->records[i], size));
    }
}

/* As the controller does (app/machine/motion). */
static int take_chunk_over(struct motion *m, const struct chunk *next,
                           const struct coefficients_window *window)
{
    const struct program *before = m->it.program;
    if (feed_override_take_over(&m->feed, &m->it, next, window) == 0) {
        return 0;
    }
    path_outputs_carry(&m->outputs, before, &next->program, next->arc_shift_q40_mm);
    m->chunk++;
    return 1;
}

/* The motion of a chain whose chunks come in time, at the takeover of each. */
static void note_begins(struct chain *c)
{
    struct motion m = {.chunk = 0};
    struct interpolator_point point;
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&m.it, &c->chunks[0].program));
    feed_override_begin_job(&m.feed, &c->chunks[0], &m.it.window,
                            c->cuts.whole->program.header.period_us);
    path_outputs_begin(&m.outputs, &c->chunks[0].program, -1);
    c->begun[0] = m;
    while (m.chunk + 1u < c->cuts.count) {
        TEST_ASSERT_EQUAL_INT(0, feed_override_next(&m.feed, &m.it, &point));
        path_outputs_step(&m.outputs, point.arc_length_q40_mm, point.feed_q32_mm_s);
        m.tick++;
        struct coefficients_window window;
        coefficients_window_of(&window, &c->chunks[m.chunk + 1u].program);
        if (take_chunk_over(&m, &c->chunks[m.chunk + 1u], &window)) {
            c->begun[m.chunk] = m;
        }
        TEST_ASSERT_FALSE(feed_override_waits(&m.feed));
    }
}

/* Each chunk is made compact or stays wide at random, where its numbers fit: so each of the two follows each. */
static void some_compact(struct chain *c, uint64_t random)
{
    unsigned previous = 0;
    for (uint32_t i = 0; i < c->cuts.count; i++) {
        const int wanted = (golden_random(&random) & 1u) != 0u;
        const unsigned compact = wanted ? (unsigned)chunked_make_compact(&c->cuts, i) : 0u;
        seen.compact += compact;
        seen.after_compact += compact & previous;
        previous = compact;
    }
}

static void make_whole(uint32_t w, uint64_t *random)
{
    struct override_program *p = &wholes[w].program;
    if (w < LINES) {
        override_program_random(p, 1000u << w, random);
    } else {
        override_program_golden(p, w < WHOLES ? GOLDEN[w % (sizeof GOLDEN / sizeof *GOLDEN)]
                                              : GOLDEN_IN_SPACE[w % 2u]);
        chunked_refine(p, override_random(random, 0.012, 0.03));
    }
    chunked_add_events(p, EVENTS, random);
    override_program_limits(p, random);
    run_whole(w);
    for (uint32_t i = 0; i < 4u * CHAINS && wholes[w].chain_count < CHAINS; i++) {
        struct chain *c = &wholes[w].chains[wholes[w].chain_count];
        if (chunked_random(&c->cuts, p, random)) {
            some_compact(c, (uint64_t)CHAINS * w + wholes[w].chain_count);
            accept(c);
            note_begins(c);
            wholes[w].chain_count++;
        }
    }
    TEST_ASSERT_TRUE(wholes[w].chain_count > 0u);
}

/* --- A tick --- */

static void check_differences(void)
{
    const double more = now.fault != 0u ? 2 : 1; /* its codes are twice those of a hold */
    const struct override_limits *limit = &now.p->limit;
    struct override_differences d;
    if (!override_trace_add(&now.trace, now.point.arc_length_q40_mm, now.h, &d)) {
        return;
    }
    at_most("jerk", d.jerk, more * limit->jerk * (1 + 1e-6) + 1.0);
    at_most("acceleration", d.acceleration, more * limit->acceleration * (1 + 1e-6) + 1e-3);
    at_most("never backwards", d.back_mm, 2e-10);
    seen.jerk = fmax(seen.jerk, d.jerk / limit->jerk / more);
}

/* Setpoints lie on the path of the whole program: each eighth, and all at rest. */
static void check_path(void)
{
    if (now.m.tick % 8u != 0 && feed_override_feed_q32(&now.m.feed) != 0) {
        return;
    }
    at_most("on the path", override_distance_q40(&now.path, &now.point), 1.2e6);
}

/* In time and without commands: what the whole program has. */
static void check_same(void)
{
    if (now.commanded == 0 && now.rested == 0 &&
        now.m.feed.clock.piece <
            now.chain->cuts.cuts[now.m.chunk].joint - now.chain->cuts.cuts[now.m.chunk].first) {
        const uint32_t last = wholes[now.which].ticks - 1u;
        const struct interpolator_point *right =
            &wholes[now.which].right[now.m.tick < last ? now.m.tick : last];
        const size_t size = offsetof(struct interpolator_point, position_q40) +
                            now.p->program.header.axis_count * sizeof(int64_t);
        equal("another setpoint than the whole program's", memcmp(right, &now.point, size) != 0, 0);
        seen.same++;
    }
}

/* The event that acts next is the first one of the whole program past the farthest setpoint. */
static void check_next_event(void)
{
    const int64_t start_q40 = now.chain->chunks[now.m.chunk].job_start_q40_mm;
    const uint32_t before = program_first_event_from(&now.p->program, start_q40);
    equal("events", now.acted, before + now.m.outputs.next);
}

/* The value is that of the last one. Arc lengths are still those of the chunk. */
static void check_events(void)
{
    const struct program *whole = &now.p->program;
    const int64_t start_q40 = now.chain->chunks[now.m.chunk].job_start_q40_mm;
    path_outputs_step(&now.m.outputs, now.point.arc_length_q40_mm, now.point.feed_q32_mm_s);
    while (now.acted < EVENTS &&
           program_event_place(whole, now.acted) <= now.point.arc_length_q40_mm + start_q40) {
        now.acted++;
    }
    check_next_event();
    equal("value", (int16_t)now.acted, now.m.outputs.values.analogue[0]);
}

static void use_records(const struct coefficients_window *window)
{
    if (window != NULL && feed_override_use(&now.m.feed, &now.m.it, window)) {
        coefficient_cache_used(&now.cache);
        seen.windows++;
    }
}

static const struct coefficients_window *make_records(void)
{
    struct feed_place place;
    feed_override_place(&now.m.feed, &now.m.it, &place);
    return coefficient_cache_prepare(&now.cache, now.m.feed.clock.program, &place);
}

/* What the main loop does between two ticks, or in the time of one. */
static void attend(void)
{
    if (now.late != 0u) {
        use_records(now.made);
        now.made = make_records();
    } else {
        use_records(make_records());
    }
}

static void tick(void)
{
    attend();
    const int waited = feed_override_waits(&now.m.feed);
    equal("an error", feed_override_next(&now.m.feed, &now.m.it, &now.point), 0);
    check_events();
    now.point.arc_length_q40_mm += now.chain->chunks[now.m.chunk].job_start_q40_mm;
    if (!waited && feed_override_waits(&now.m.feed)) {
        now.rested++;
        seen.underruns++;
    }
    check_differences();
    check_path();
    check_same();
    equal("late", feed_override_late(&now.m.feed), 0);
    now.m.tick++;
    seen.ticks++;
}

static int over(void)
{
    const enum feed_state state = feed_override_state(&now.m.feed);
    return state == FEED_ENDED || state == FEED_STOPPED;
}

static int rests(void)
{
    return over() || feed_override_state(&now.m.feed) == FEED_HELD ||
           feed_override_waits(&now.m.feed) ||
           (feed_override_state(&now.m.feed) == FEED_RUNNING && now.m.feed.plan.started != 0 &&
            now.m.feed.plan.requested_q57 == 0 && now.m.feed.plan.now.override_q57 == 0);
}

/* --- A case --- */

static void command(uint64_t *random)
{
    const uint64_t kind = golden_random(random) % 8u;
    now.commanded++;
    if (kind < 2) {
        now.held = 1;
        feed_override_hold(&now.m.feed);
    } else if (kind < 4) {
        now.held = 0;
        feed_override_resume(&now.m.feed);
    } else if (kind < 7 || golden_random(random) % 4u != 0) {
        feed_override_set(&now.m.feed, (uint32_t)(golden_random(random) % 201u));
    } else if (golden_random(random) % 2u == 0) {
        feed_override_stop(&now.m.feed);
    } else {
        now.fault |= over() ? 0u : 1u;
        feed_override_fault_stop(&now.m.feed);
    }
}

/* A chunk comes damaged, or in the wrong order: refused, and nothing changes. */
static void refuse(uint64_t *random)
{
    const struct program_limits limits = golden_no_limits();
    struct chunked *cuts = &now.chain->cuts;
    const uint32_t i = (uint32_t)(golden_random(random) % cuts->count);
    const uint64_t bit = golden_random(random) % (8u * cuts->sizes[i]);
    struct program_fault fault;
    struct chunk chunk;
    if (i != now.m.chunk + 1u && golden_random(random) % 2u == 0) { /* again, or out of order */
        TEST_ASSERT_EQUAL_INT(0, chunk_open(&chunk, cuts->bytes[i], cuts->sizes[i]));
        TEST_ASSERT_EQUAL_INT(
            PROGRAM_ERR_CHUNK_SEQUENCE,
            chunk_check(&chunk, &now.chain->chunks[now.m.chunk], &limits, &fault));
    } else {
        cuts->bytes[i][bit / 8u] ^= (uint8_t)(1u << bit % 8u);
        TEST_ASSERT_TRUE(chunk_open(&chunk, cuts->bytes[i], cuts->sizes[i]) < 0);
        cuts->bytes[i][bit / 8u] ^= (uint8_t)(1u << bit % 8u);
    }
    seen.refused++;
}

/* The next chunk is there: it is taken over when that is possible. */
static void try_to_take_over(void)
{
    const int moves = feed_override_feed_q32(&now.m.feed) != 0;
    struct feed_place place;
    if (now.m.chunk + 1u == now.chain->cuts.count) {
        return;
    }
    const struct chunk *next = &now.chain->chunks[now.m.chunk + 1u];
    if (!feed_override_may_take_over(&now.m.feed, &now.m.it, next, &place)) {
        return;
    }
    now.made = NULL;
    const struct coefficients_window *window =
        coefficient_cache_prepare(&now.cache, &next->program, &place);
    TEST_ASSERT_NOT_NULL(window);
    if (take_chunk_over(&now.m, next, window)) {
        check_next_event();
        coefficient_cache_used(&now.cache);
        seen.moving += moves ? 1u : 0u;
        seen.resting += moves ? 0u : 1u;
    }
}

/* The motion goes on with a cache instead of all records of its chunk. */
static void begin_cache(uint64_t *random)
{
    const struct kernel *fixed = kernel_find(KERNEL_FIXED);
    const uint32_t axes = now.p->program.header.axis_count;
    const uint32_t least =
        2u * COEFFICIENT_CACHE_LEAST *
            (coefficients_piece_size(fixed) + coefficients_segment_size(fixed, axes)) +
        COEFFICIENTS_ALIGNMENT;
    const uint32_t size = least << golden_random(random) % 4u;
    TEST_ASSERT_TRUE(2u * size <= CACHE_MOST);
    coefficient_cache_init(&now.cache, (uint8_t *)cache_memory,
                           size + (uint32_t)(golden_random(random) % size));
    TEST_ASSERT_TRUE(coefficient_cache_fits(&now.cache, fixed, axes));
    (void)feed_override_use(&now.m.feed, &now.m.it,
                            coefficient_cache_begin(&now.cache, now.m.feed.clock.program, fixed));
    use_records(make_records());
    now.late = size >= CACHE_LATE ? (uint32_t)(golden_random(random) % 2u) : 0u;
}

static void begin(uint64_t *random, uint32_t first, uint32_t count)
{
    const unsigned number = now.number;
    memset(&now, 0, sizeof now);
    now.number = number;
    now.which = first + (uint32_t)(golden_random(random) % count);
    now.p = &wholes[now.which].program;
    now.chain = &wholes[now.which].chains[golden_random(random) % wholes[now.which].chain_count];
    now.m = now.chain->begun[golden_random(random) % now.chain->cuts.count];
    now.h = now.p->program.header.period_us * 1e-6;
    now.acted = (uint32_t)now.m.outputs.values.analogue[0];
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&now.path, &wholes[now.which].exact.program));
    begin_cache(random);
}

/* The host sends no more: to rest, unless the override is nothing or it has been held there. */
static void end(uint64_t *random)
{
    if (now.m.feed.plan.requested_q57 < OVERRIDE_ONE / 2) {
        feed_override_set(&now.m.feed, 60u + (uint32_t)(golden_random(random) % 100u));
    }
    for (uint32_t i = 0; i < LONGEST && !rests(); i++) {
        tick();
    }
    equal("rests", rests(), 1);
    const struct interpolator_point place = now.point;
    for (int i = 0; i < 3; i++) {
        tick();
        TEST_ASSERT_EQUAL_MEMORY(&place, &now.point, sizeof place);
    }
    seen.ended += feed_override_state(&now.m.feed) == FEED_ENDED;
    seen.stopped += feed_override_state(&now.m.feed) == FEED_STOPPED;
    seen.held += feed_override_state(&now.m.feed) == FEED_HELD;
    seen.waited += feed_override_waits(&now.m.feed) ? 1u : 0u;
    if (feed_override_state(&now.m.feed) == FEED_ENDED) {
        TEST_ASSERT_TRUE(now.point.arc_length_q40_mm == now.p->program.header.length_q40_mm);
    }
}

/* 0 to 256, the short ones often. */
static uint32_t some_ticks(uint64_t *random)
{
    const uint32_t most = 4u << golden_random(random) % 7u;
    return (uint32_t)(golden_random(random) % most);
}

/* A cut of one of `count` wholes from the first on. */
static void run_case(uint64_t seed, uint32_t first, uint32_t count)
{
    uint64_t random = seed;
    begin(&random, first, count);
    const uint32_t arrivals = 1u + (uint32_t)(golden_random(&random) % 3u);
    const int quiet = golden_random(&random) % 4u == 0;
    for (uint32_t i = 0; i < arrivals && !over(); i++) {
        const uint32_t wait = some_ticks(&random);
        const uint32_t there = some_ticks(&random);
        for (uint32_t k = 0; k < wait + there && !over(); k++) {
            if (!quiet && golden_random(&random) % 32u == 0) {
                command(&random);
            }
            if (golden_random(&random) % 512u == 0) {
                refuse(&random);
            }
            if (k >= wait) {
                try_to_take_over();
            }
            tick();
        }
    }
    end(&random);
}

static unsigned setting(const char *name, unsigned otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? (unsigned)strtoul(text, NULL, 10) : otherwise;
}

static void free_all(void)
{
    for (uint32_t w = 0; w < WHOLES + IN_SPACE; w++) {
        for (uint32_t i = 0; i < wholes[w].chain_count; i++) {
            struct chain *c = &wholes[w].chains[i];
            for (uint32_t k = 0; k < c->cuts.count; k++) {
                free(c->records[k]);
            }
            chunked_close(&c->cuts);
        }
        golden_discard(&wholes[w].exact);
        override_program_close(&wholes[w].program);
    }
}

static void test_cuts_at_any_instant(void)
{
    const unsigned cases = setting("HODOGRAPH_CASES", CASES);
    uint64_t seed = setting("HODOGRAPH_SEED", 1);
    uint64_t random = seed;
    for (uint32_t w = 0; w < WHOLES + IN_SPACE; w++) {
        make_whole(w, &random);
    }
    TEST_ASSERT_TRUE(seen.compact > WHOLES && seen.after_compact > WHOLES);
    for (unsigned i = setting("HODOGRAPH_FIRST", 0); i < cases; i++) {
        now.number = i;
        run_case(seed * 0x100000001u + i, 0, WHOLES);
        if (i % SPACE_PART == 0u) {
            run_case(seed * 0x100000001u + i, WHOLES, IN_SPACE);
        }
    }
    now.number = HOLD_IN_A_RISE;
    run_case(seed * 0x100000001u + HOLD_IN_A_RISE, 0, WHOLES);
    printf("%u cuts, %.3g ticks: %u takeovers in motion, %u at rest, %u chunks refused, %u rests "
           "at the end of a tail; ended %u, stopped %u, held %u, waits %u; %u setpoints beside "
           "the whole; %u windows of records; %u compact chunks; jerk %.4f of the limit\n",
           cases, (double)seen.ticks, seen.moving, seen.resting, seen.refused, seen.underruns,
           seen.ended, seen.stopped, seen.held, seen.waited, seen.same, seen.windows, seen.compact,
           seen.jerk);
    if (cases >= 1000u) {
        TEST_ASSERT_TRUE(seen.moving > cases / 8u && seen.resting > cases / 64u);
        TEST_ASSERT_TRUE(seen.refused > 0 && seen.underruns > cases / 8u && seen.same > cases);
        TEST_ASSERT_TRUE(seen.ended > 0 && seen.stopped > 0 && seen.held > 0 && seen.waited > 0);
    }
    free_all();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_cuts_at_any_instant);
    return UNITY_END();
}
