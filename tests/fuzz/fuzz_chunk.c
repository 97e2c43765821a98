/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of core/chunk.h: chunks of a job with changes, always with the CRCs that they should have. What
 * chunk_check accepts is taken over and runs under holds, resumes, overrides, stops and fault stops at any tick, each
 * chunk in time, late or never. Setpoints do not jump, the motion along the path keeps the limits that the chunks were
 * checked against, and no stop takes longer than its deadline.
 *
 * Input: which job and form (job + JOBS * form), 16 commands (ticks to wait, command), the ticks from which each chunk
 * is there, then changes.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). Reads files of
 * tests/data; no other I/O, except that a broken rule is printed and aborts the process.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "chunked.h"
#include "core/coefficient_cache.h"
#include "core/feed_override.h"
#include "fuzz.h"
#include "golden.h"

#define JOBS        7u /* in the plane, one of them with events; in space; with six axes */
#define FORM_COUNT  8u
#define WITH_EVENTS 4u /* the first job that has events, as all after it */
#define EVENTS      40u
#define COMMANDS    16u
#define TICKS_MAX   2500u
#define NEVER       255u
#define CACHE_SIZE  8192u
#define FAULT       2.0  /* codes of a fault stop are twice those of a hold (stop_table.h) */
#define NOISE_MM    4e-9 /* of the double kernel, and of an arc length at a takeover */
#define STEPS       1.02 /* what joints of pieces may add (docs/guides/limits.md) */
#define BACK_MM 0.0002 /* a feed may run back by 2^-14 mm, and the next setpoint come from there */
#define Q40     1099511627776.0

/* In a form, chunk i is compact where bit i of its mask is set and its numbers fit. */
static const struct form {
    uint32_t compact;
    int at_rest; /* two chunks, the second at rest where the first ends */
} FORMS[FORM_COUNT] = {{0u, 0}, {UINT32_MAX, 0}, {0x55555555u, 0}, {0xAAAAAAAAu, 0},
                       {0u, 1}, {UINT32_MAX, 1}, {1u, 1},          {2u, 1}};

static struct job {
    struct override_program whole;
    struct chunked cuts[FORM_COUNT];
} jobs[JOBS];

/* As a job comes: its chunks with the changes of the input. */
struct part {
    uint8_t *bytes; /* exactly as long as its size, so that the sanitizer detects any read beyond */
    uint32_t size;
    struct chunk chunk;
    uint32_t from_tick;
};

struct run {
    struct part parts[CHUNKED_MOST];
    uint32_t count; /* of parts that were accepted */
    uint32_t now;   /* the one under way */
    struct feed_override feed;
    struct interpolator it;
    struct coefficient_cache cache;
    double period_s;
    double arc_mm[4];
    double place_mm[2][PROGRAM_SPACE];
    unsigned known;
};

static void make_form(struct chunked *out, const struct chunked *wide, const struct form *form)
{
    chunked_copy(out, wide);
    if (form->at_rest != 0) {
        chunked_make_rest(out);
    }
    for (uint32_t i = 0; i < out->count; i++) {
        if ((form->compact >> i & 1u) != 0u) {
            (void)chunked_make_compact(out, i);
        }
    }
}

static void make_jobs(void)
{
    static const char *const names[JOBS] = {
        "alpha_minimax.hdgp",     "line.hdgp",   "heart_minimax.hdgp", "alpha_exponential.hdgp",
        "alpha_exponential.hdgp", "space3.hdgp", "space6.hdgp"};
    uint64_t random = 5;
    for (unsigned i = 0; i < JOBS && jobs[JOBS - 1u].cuts[0].count == 0u; i++) {
        struct chunked wide;
        override_program_golden(&jobs[i].whole, names[i]);
        chunked_refine(&jobs[i].whole, 0.03);
        override_program_limits(&jobs[i].whole, &random);
        if (i >= WITH_EVENTS) {
            chunked_add_events(&jobs[i].whole, EVENTS, &random);
        }
        while (chunked_random(&wide, &jobs[i].whole, &random) == 0) {
        }
        for (size_t k = 0; k < FORM_COUNT; k++) {
            make_form(&jobs[i].cuts[k], &wide, &FORMS[k]);
        }
        chunked_close(&wide);
    }
}

/* --- Changes --- */

static void put(struct part *part, uint32_t at, uint64_t value, unsigned bytes)
{
    for (unsigned i = 0; i < bytes && at + i < part->size; i++) {
        part->bytes[at + i] = (uint8_t)(value >> 8u * i);
    }
}

static uint64_t get(const struct part *part, uint32_t at, unsigned bytes)
{
    uint64_t value = 0;
    for (unsigned i = 0; i < bytes && at + i < part->size; i++) {
        value |= (uint64_t)part->bytes[at + i] << 8u * i;
    }
    return value;
}

/* A byte, a bit, a field; in the header more often than in the long image. */
static void change(struct run *run, uint32_t count, struct fuzz_input *in)
{
    static const uint64_t extremes[] = {0, UINT64_MAX, UINT64_C(1) << 63, UINT64_MAX >> 1};
    struct part *part = &run->parts[fuzz_byte(in) % count];
    const uint8_t how = fuzz_byte(in);
    const uint32_t anywhere = fuzz_number(in, 2);
    const uint8_t value = fuzz_byte(in);
    FUZZ_CHECK(part->size > CHUNK_HEADER_SIZE);
    const uint32_t at =
        anywhere % (how >= 128u ? CHUNK_HEADER_SIZE + PROGRAM_HEADER_SIZE : part->size);
    switch (how % 5u) {
    case 0:
        put(part, at, value, 1);
        break;
    case 1:
        put(part, at, get(part, at, 1) ^ 1u << value % 8u, 1);
        break;
    case 2:
        put(part, at & ~3u, get(part, at & ~3u, 4) + value - 128u, 4);
        break;
    case 3:
        put(part, at & ~7u, get(part, at & ~7u, 8) + value - 128u, 8);
        break;
    default:
        put(part, at & ~7u, extremes[value % 4u], 8);
        break;
    }
}

/* --- What is accepted --- */

static struct program_limits limits_of(const struct job *job)
{
    struct program_limits limits = golden_no_limits();
    limits.feed_um_s = (uint32_t)(1e3 * job->whole.limit.feed) + 1u;
    limits.acceleration_um_s2 = (uint32_t)(1e3 * FAULT * job->whole.limit.acceleration) + 1u;
    limits.jerk_mm_s3 = (uint32_t)(FAULT * job->whole.limit.jerk) + 1u;
    return limits;
}

/* The parts up to the first that is refused. */
static void accept(struct run *run, uint32_t count, const struct program_limits *limits)
{
    for (uint32_t i = 0; i < count; i++) {
        struct part *part = &run->parts[i];
        struct program_fault fault;
        chunked_seal(part->bytes, part->size);
        if (chunk_open(&part->chunk, part->bytes, part->size) != 0 ||
            chunk_check(&part->chunk, i > 0u ? &part[-1].chunk : NULL, limits, &fault) != 0) {
            return;
        }
        run->count++;
    }
}

/* --- The run --- */

static void give_command(struct run *run, uint8_t what)
{
    if (what < 6u) {
        feed_override_stop(&run->feed);
    } else if (what < 12u) {
        feed_override_fault_stop(&run->feed);
    } else if (what < 28u) {
        feed_override_hold(&run->feed);
    } else if (what < 48u) {
        feed_override_resume(&run->feed);
    } else {
        feed_override_set(&run->feed, what - 48u);
    }
}

static void keeps(struct run *run, const struct interpolator_point *point,
                  const struct program_limits *limits)
{
    const double h = run->period_s;
    const double *s = run->arc_mm;
    const double noise = NOISE_MM / h;
    const struct program_header *header = &run->parts[run->now].chunk.program.header;
    const uint32_t axes = program_curve_axes(header->axis_count);
    const double job_mm = (double)run->parts[run->now].chunk.job_start_q40_mm / Q40;
    memmove(run->arc_mm, run->arc_mm + 1, 3 * sizeof *run->arc_mm);
    memcpy(run->place_mm[0], run->place_mm[1], sizeof run->place_mm[0]);
    run->arc_mm[3] = (double)point->arc_length_q40_mm / Q40 + job_mm;
    double square = 0;
    for (uint32_t axis = 0; axis < axes; axis++) {
        run->place_mm[1][axis] = (double)point->position_q40[axis] / Q40;
        const double step_mm = run->place_mm[1][axis] - run->place_mm[0][axis];
        square += step_mm * step_mm;
    }
    if (++run->known < 4u) {
        return;
    }
    FUZZ_CHECK(sqrt(square) <= (1e-3 * STEPS * limits->feed_um_s + noise) * h + BACK_MM);
    FUZZ_CHECK(s[3] - s[2] >= -BACK_MM);
    FUZZ_CHECK((s[3] - s[2]) / h <= 1e-3 * STEPS * limits->feed_um_s + noise);
    FUZZ_CHECK(fabs(s[3] - 2 * s[2] + s[1]) / (h * h) <=
               1e-3 * STEPS * limits->acceleration_um_s2 + 2 * noise / h);
    FUZZ_CHECK(fabs(s[3] - 3 * s[2] + 3 * s[1] - s[0]) / (h * h * h) <=
               STEPS * limits->jerk_mm_s3 + 4 * noise / (h * h));
}

static int over(const struct run *run)
{
    const enum feed_state state = feed_override_state(&run->feed);
    return state == FEED_ENDED || state == FEED_STOPPED;
}

static void make_records(struct run *run)
{
    struct feed_place place;
    feed_override_place(&run->feed, &run->it, &place);
    const struct coefficients_window *window =
        coefficient_cache_prepare(&run->cache, &run->parts[run->now].chunk.program, &place);
    if (window != NULL && feed_override_use(&run->feed, &run->it, window) != 0) {
        coefficient_cache_used(&run->cache);
    }
}

static void take_over(struct run *run, uint32_t tick)
{
    const uint32_t number = run->now + 1u;
    if (number >= run->count || tick < run->parts[number].from_tick) {
        return;
    }
    const struct chunk *next = &run->parts[number].chunk;
    struct feed_place place;
    if (feed_override_may_take_over(&run->feed, &run->it, next, &place) != 0) {
        const struct coefficients_window *window =
            coefficient_cache_prepare(&run->cache, &next->program, &place);
        FUZZ_CHECK(window != NULL);
        if (feed_override_take_over(&run->feed, &run->it, next, window) != 0) {
            coefficient_cache_used(&run->cache);
            run->now = number;
        }
    }
}

/* With a cache as small as that of a small controller. */
static void begin_job(struct run *run, const struct chunk *first)
{
    static uint64_t memory[CACHE_SIZE / 8u];
    coefficient_cache_init(&run->cache, (uint8_t *)memory, CACHE_SIZE);
    const struct coefficients_window *window =
        coefficient_cache_begin(&run->cache, &first->program, kernel_find(KERNEL_DOUBLE));
    interpolator_begin_window(&run->it, &first->program, window);
    feed_override_begin_job(&run->feed, first, window, first->program.header.period_us);
}

static void run_accepted(struct run *run, const struct program_limits *limits,
                         const uint8_t commands[2 * COMMANDS])
{
    const struct chunk *first = &run->parts[0].chunk;
    unsigned command = 0;
    unsigned waited = 0;
    run->period_s = 1e-6 * first->program.header.period_us;
    begin_job(run, first);
    for (uint32_t tick = 0; tick < TICKS_MAX && !over(run); tick++) {
        struct interpolator_point point = {0};
        while (command < COMMANDS && waited >= commands[2u * command]) {
            give_command(run, commands[2u * command + 1u]);
            command++;
            waited = 0;
        }
        waited++;
        make_records(run);
        take_over(run, tick);
        FUZZ_CHECK(feed_override_next(&run->feed, &run->it, &point) >= 0);
        FUZZ_CHECK(!feed_override_late(&run->feed));
        keeps(run, &point, limits);
    }
}

static void harness(struct fuzz_input *in)
{
    static struct run run;
    uint8_t commands[2 * COMMANDS];
    make_jobs();
    memset(&run, 0, sizeof run);
    const uint8_t which = fuzz_byte(in);
    const struct job *job = &jobs[which % JOBS];
    const struct chunked *cuts = &job->cuts[which / JOBS % FORM_COUNT];
    const uint32_t count = cuts->count;
    const struct program_limits limits = limits_of(job);
    FUZZ_CHECK(count > 0u);
    fuzz_bytes(in, commands, sizeof commands);
    for (uint32_t i = 0; i < count; i++) {
        struct part *part = &run.parts[i];
        const uint8_t from = fuzz_byte(in);
        part->from_tick = from == NEVER ? UINT32_MAX : 8u * from;
        part->size = cuts->sizes[i];
        part->bytes = malloc(part->size);
        FUZZ_CHECK(part->bytes != NULL);
        memcpy(part->bytes, cuts->bytes[i], part->size);
    }
    while (fuzz_left(in)) {
        change(&run, count, in);
    }
    accept(&run, count, &limits);
    if (run.count > 0u) {
        run_accepted(&run, &limits, commands);
    }
    for (uint32_t i = 0; i < count; i++) {
        free(run.parts[i].bytes);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
