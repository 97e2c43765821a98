/* SPDX-License-Identifier: MIT */
/* Implements offline/stream.h (see there): a job in chunks without a bus. Called by host_tools/hodograph/native. Chunks
 * are opened, checked and taken over by the code of the controller, one attempt before each tick; commands are those of
 * the feed override. Dwells between chunks take their ticks, program stops no time. Changes only its struct and the
 * lent memory; no I/O. */
#include "offline/stream.h"

#include <stddef.h>
#include <string.h>

void offline_stream_begin(struct offline_stream *s, const struct kernel *kernel,
                          const struct program_limits *limits, uint8_t *memory, uint32_t size)
{
    memset(s, 0, sizeof *s);
    s->kernel = kernel;
    s->limits = *limits;
    coefficient_cache_init(&s->cache, memory, size);
}

int offline_stream_check(const struct offline_stream *s, struct offline_part *part,
                         const uint8_t *bytes, uint32_t size, struct program_fault *fault)
{
    const struct chunk *before = s->newest != NULL ? &s->newest->chunk : NULL;
    memset(part, 0, sizeof *part);
    fault->index = 0;
    fault->code = chunk_open(&part->chunk, bytes, size);
    return fault->code != 0 ? fault->code : chunk_check(&part->chunk, before, &s->limits, fault);
}

static void begin(struct offline_stream *s, const struct chunk *first)
{
    const struct program *p = &first->program;
    const struct coefficients_window *window = coefficient_cache_begin(&s->cache, p, s->kernel);
    interpolator_begin_window(&s->interp, p, window);
    feed_override_begin_job(&s->feed, first, window, p->header.period_us);
    path_outputs_begin(&s->outputs, p, -1);
}

int offline_stream_add(struct offline_stream *s, struct offline_part *part)
{
    if (!coefficient_cache_fits(&s->cache, s->kernel, part->chunk.program.header.axis_count)) {
        return COEFFICIENTS_ERR_SIZE;
    }
    if (s->active == NULL) {
        s->active = part;
        begin(s, &part->chunk);
    } else {
        s->newest->next = part;
    }
    s->newest = part;
    return 0;
}

static void make_records(struct offline_stream *s)
{
    struct feed_place place;
    feed_override_place(&s->feed, &s->interp, &place);
    const struct coefficients_window *window =
        coefficient_cache_prepare(&s->cache, &s->active->chunk.program, &place);
    if (window != NULL && feed_override_use(&s->feed, &s->interp, window)) {
        coefficient_cache_used(&s->cache);
    }
}

static void carry_outputs(struct offline_stream *s, const struct chunk *next)
{
    if (chunk_begins_at_rest(next)) {
        path_outputs_begin_next(&s->outputs, &next->program);
    } else {
        path_outputs_carry(&s->outputs, &s->active->chunk.program, &next->program,
                           next->arc_shift_q40_mm);
    }
}

static void take_over(struct offline_stream *s)
{
    struct offline_part *next = s->active->next;
    const int rests = feed_override_feed_q32(&s->feed) == 0;
    struct feed_place place;
    if (next == NULL || !feed_override_may_take_over(&s->feed, &s->interp, &next->chunk, &place)) {
        return;
    }
    const struct coefficients_window *window =
        coefficient_cache_prepare(&s->cache, &next->chunk.program, &place);
    if (!feed_override_take_over(&s->feed, &s->interp, &next->chunk, window)) {
        return;
    }
    coefficient_cache_used(&s->cache);
    carry_outputs(s, &next->chunk);
    if (chunk_begins_at_rest(&next->chunk)) {
        const uint32_t ticks = chunk_rest_ticks(&next->chunk);
        s->rest_ticks = ticks > s->waited_ticks ? ticks - s->waited_ticks : 0u;
    }
    s->active = next;
    s->resting += rests ? 1u : 0u;
    s->moving += rests ? 0u : 1u;
}

/* At the end of a chunk without a next one. */
static int misses_next(const struct offline_stream *s)
{
    const struct offline_part *next = s->active->next;
    return feed_override_waits(&s->feed) && (next == NULL || !chunk_begins_at_rest(&next->chunk));
}

static int tick(struct offline_stream *s, struct interpolator_point *point)
{
    make_records(s);
    s->waited_ticks = feed_override_waits(&s->feed) ? s->waited_ticks : 0u;
    take_over(s);
    s->waited_ticks += feed_override_waits(&s->feed) ? 1u : 0u;
    s->ticks++;
    if (s->rest_ticks != 0u) {
        s->rest_ticks--;
        *point = s->last;
        return 0;
    }
    const int result = feed_override_next(&s->feed, &s->interp, point);
    path_outputs_step(&s->outputs, point->arc_length_q40_mm, feed_override_feed_q32(&s->feed));
    const uint32_t waits = misses_next(s) ? 1u : 0u;
    point->arc_length_q40_mm += s->active->chunk.job_start_q40_mm;
    s->underruns += waits & ~s->rested;
    s->rested = waits;
    s->last = *point;
    return result;
}

static int is_over(const struct offline_stream *s, uint32_t until_rest)
{
    const enum feed_state state = feed_override_state(&s->feed);
    return state == FEED_ENDED || state == FEED_STOPPED ||
           (until_rest != 0u && s->rested != 0u && s->active->next == NULL);
}

int64_t offline_stream_run(struct offline_stream *s, uint32_t count, uint32_t until_rest,
                           struct interpolator_point *points, struct path_outputs_values *values)
{
    uint32_t done = 0;
    while (done < count && s->active != NULL && !is_over(s, until_rest)) {
        const int result = tick(s, &points[done]);
        if (result < 0) {
            return result;
        }
        if (values != NULL) {
            values[done] = s->outputs.values;
        }
        done++;
    }
    return (int64_t)done;
}
