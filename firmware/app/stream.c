/* SPDX-License-Identifier: MIT */
/* Implements app/stream.h (see there): a job that comes in chunks (object 0x2060). Called by app/objects_stream,
 * app/objects_program, app/commands and app/controller.c. Main loop; takes the port's lock where it reads or changes
 * the machine. Changes its struct and the port's memory for chunks, and prints by port_log. */
#include "app/stream.h"

#include <string.h>

#include "app/machine/path_counts.h"
#include "core/first_axis.h"
#include "core/qmath.h"
#include "port/port.h"

/* At the start of a block of the ring; the bytes of the chunk follow. */
struct stream_chunk {
    struct stream_chunk *next; /* accepted after it; NULL: the newest */
    uint64_t job_time_q32_s;   /* time of the job at its program time 0, */
    uint64_t joint_time_q32_s; /* and at its joint */
    struct chunk chunk;
};

/* bytes of a block of the ring before those of its chunk */
#define HEAD_SIZE ((uint32_t)sizeof(struct stream_chunk))

/* Hosts make chunks so small that three with such heads fit the ring (docs/reference/protocol.md 3.7). */
typedef char stream_assert_head[sizeof(struct stream_chunk) <= 384u ? 1 : -1];
typedef char
    stream_assert_aligned[sizeof(struct stream_chunk) % CHUNK_RING_ALIGNMENT == 0u ? 1 : -1];

void stream_init(struct stream *stream)
{
    uint32_t size;
    uint8_t *memory = port_stream_memory(&size);
    memset(stream, 0, sizeof *stream);
    chunk_ring_init(&stream->ring, memory, size);
    chunk_records_init(&stream->records);
    stream->optional_stop = true;
}

/* ---- A download ---- */

int stream_begin(struct stream *stream, uint32_t size)
{
    uint32_t room = 0;
    stream_abandon(stream);
    if (size > stream->ring.size) {
        return PROGRAM_ERR_ROOM;
    }
    /* A chunk whose size is not stated gets all the room that 0x2060 sub 7 reports. */
    const uint32_t least = size == 0u ? chunk_ring_room(&stream->ring) : HEAD_SIZE + size;
    stream->receiving = least < HEAD_SIZE ? NULL : chunk_ring_take(&stream->ring, least, &room);
    if (stream->receiving == NULL) {
        return PROGRAM_ERR_ROOM;
    }
    stream->receiving_bytes = room - HEAD_SIZE;
    return 0;
}

int stream_write(struct stream *stream, uint32_t offset, const uint8_t *data, uint32_t size)
{
    const uint32_t room = stream->receiving_bytes;
    if (offset > room || size > room - offset) {
        return PROGRAM_ERR_ROOM;
    }
    memcpy(stream->receiving + HEAD_SIZE + offset, data, size);
    return 0;
}

void stream_abandon(struct stream *stream)
{
    if (stream->receiving != NULL) {
        chunk_ring_give_back(&stream->ring);
    }
    stream->receiving = NULL;
    stream->receiving_bytes = 0;
}

/* ---- Checks of a chunk ---- */

static bool is_over(const struct stream *stream)
{
    return stream->state == STREAM_ENDED || stream->state == STREAM_STOPPED;
}

static bool opens_a_job(const struct stream *stream, const struct chunk *chunk)
{
    return (chunk->flags & CHUNK_FLAG_FIRST) != 0u && chunk->job != stream->job;
}

/* Whether the chunk is the next one of the job. */
static int check_sequence(const struct stream *stream, const struct chunk *chunk,
                          const struct config *config)
{
    if (opens_a_job(stream, chunk)) {
        return stream->started && !is_over(stream) ? PROGRAM_ERR_CHUNK_JOB : 0;
    }
    if (stream->job == 0u || chunk->job != stream->job) {
        return PROGRAM_ERR_CHUNK_JOB;
    }
    if (chunk->sequence != stream->wanted) {
        return PROGRAM_ERR_CHUNK_SEQUENCE;
    }
    return is_over(stream) || stream->config_crc32 != config->crc32 ? PROGRAM_ERR_CHUNK_OVER : 0;
}

static int check_program(const struct stream *stream, struct chunk *chunk,
                         const struct config *config, struct program_fault *fault)
{
    const struct chunk *previous = opens_a_job(stream, chunk) ? NULL : &stream->newest->chunk;
    struct program_limits limits;
    if (first_axis_end(&chunk->program.header) > config->axis_count) {
        return PROGRAM_ERR_AXES;
    }
    config_limits(config, first_axis(&chunk->program.header), &limits);
    limits.attend = stream->attend;
    limits.self = stream->self;
    return chunk_check(chunk, previous, &limits, fault);
}

/* Shortens the block to the size of the chunk. */
static int fit(struct stream *stream, const struct chunk *chunk, const struct config *config)
{
    const int code = chunk_records_check(&stream->records, &chunk->program, config);
    if (code == 0) {
        chunk_ring_trim(&stream->ring, HEAD_SIZE + chunk->size);
    }
    return code;
}

/* The first rule that the received chunk breaks. */
static struct program_fault check(struct stream *stream, struct chunk *chunk, uint32_t size,
                                  const struct config *config)
{
    struct program_fault fault = {.code = 0, .index = 0};
    fault.code = chunk_open(chunk, stream->receiving + HEAD_SIZE, size);
    if (fault.code == 0 && chunk->size != size) {
        fault.code = PROGRAM_ERR_CHUNK_FORMAT;
    }
    fault.code = fault.code != 0 ? fault.code : check_sequence(stream, chunk, config);
    fault.code = fault.code != 0 ? fault.code : check_program(stream, chunk, config, &fault);
    fault.code = fault.code != 0 ? fault.code : fit(stream, chunk, config);
    return fault;
}

/* ---- A chunk that has passed ---- */

/* Less than 2^32 periods of at most 8 ms, which is below 2^36 ms. Together with 2^22 s of a program below 2^64. */
static uint64_t ticks_q32_s(uint32_t ticks, uint32_t period_us)
{
    const uint64_t time_ms = (uint64_t)ticks * (period_us / 1000u);
    const uint64_t time_s = qmath_div_u64(time_ms, 1000u);
    return (time_s << 32) + qmath_div_u64((time_ms - 1000u * time_s) << 32, 1000u);
}

static void enter(struct stream *stream, struct stream_chunk *at)
{
    stream->executed = at;
    stream->place = (struct stream_place){.sequence = at->chunk.sequence,
                                          .line = at->chunk.line,
                                          .job_start_q40_mm = at->chunk.job_start_q40_mm,
                                          .job_time_q32_s = at->job_time_q32_s};
}

static void open_job(struct stream *stream, struct stream_chunk *first, const struct config *config)
{
    int32_t end_counts[AXES_MAX];
    first->job_time_q32_s = 0;
    path_counts_ends(&first->chunk.program, config, stream->start_counts, end_counts);
    chunk_ring_free_oldest(&stream->ring, (const uint8_t *)first);
    stream->job = first->chunk.job;
    stream->config_crc32 = config->crc32;
    stream->underruns = 0;
    stream->stopped_for = 0;
    stream->started = false;
    stream->waits = false;
    stream->state = STREAM_OPEN;
    enter(stream, first);
}

/* Time of the job at the start of a chunk after the newest one. */
static uint64_t job_time_after_q32_s(const struct stream_chunk *newest, const struct chunk *chunk)
{
    if (!chunk_begins_at_rest(chunk)) {
        return newest->job_time_q32_s + chunk->time_shift_q32_s;
    }
    const struct program_header *before = &newest->chunk.program.header;
    return newest->job_time_q32_s + before->duration_q32_s +
           ticks_q32_s(chunk_rest_ticks(chunk), before->period_us);
}

static void accept(struct stream *stream, struct stream_chunk *chunk, const struct config *config)
{
    chunk->next = NULL;
    if (opens_a_job(stream, &chunk->chunk)) {
        open_job(stream, chunk, config);
    } else {
        chunk->job_time_q32_s = job_time_after_q32_s(stream->newest, &chunk->chunk);
        stream->newest->next = chunk;
    }
    chunk->joint_time_q32_s =
        chunk->job_time_q32_s + chunk->chunk.joint_time_q32_s - chunk->chunk.time_shift_q32_s;
    stream->newest = chunk;
    stream->wanted = chunk->chunk.sequence + 1u;
}

int stream_finish(struct stream *stream, uint32_t size, const struct config *config)
{
    struct stream_chunk *candidate = (struct stream_chunk *)(void *)stream->receiving;
    stream->refused = check(stream, &candidate->chunk, size, config);
    if (stream->refused.code != 0) {
        stream_abandon(stream);
        return stream->refused.code;
    }
    stream->receiving = NULL;
    stream->receiving_bytes = 0;
    accept(stream, candidate, config);
    return 0;
}

/* ---- The job ---- */

static void drop_chunks(struct stream *stream)
{
    stream_abandon(stream);
    chunk_ring_clear(&stream->ring);
    stream->executed = NULL;
    stream->newest = NULL;
}

void stream_close(struct stream *stream)
{
    drop_chunks(stream);
    stream->job = 0;
    stream->wanted = 0;
    stream->underruns = 0;
    stream->started = false;
    stream->state = STREAM_NONE;
    stream->place = (struct stream_place){.sequence = 0};
}

enum machine_refusal stream_prepare(struct stream *stream, const struct config *config,
                                    struct motion *prepared, int32_t start_counts[AXES_MAX])
{
    if (stream->started) {
        return MACHINE_JOB_STARTED;
    }
    if (stream->config_crc32 != config->crc32) {
        return MACHINE_OUTSIDE_LIMITS;
    }
    const struct chunk *first = &stream->executed->chunk;
    motion_begin_job(prepared, first,
                     chunk_records_begin(&stream->records, &first->program, config), config);
    memcpy(start_counts, stream->start_counts, sizeof stream->start_counts);
    return MACHINE_ACCEPTED;
}

void stream_started(struct stream *stream)
{
    stream->started = true;
}

/* ---- A round ---- */

/* The next chunk, if the motion rests before it; NULL: it does not. */
static const struct chunk *chunk_after_rest(const struct stream *stream,
                                            const struct machine *machine)
{
    const struct stream_chunk *next = stream->executed->next;
    return next != NULL && chunk_begins_at_rest(&next->chunk) && machine_waits_for_chunk(machine)
               ? &next->chunk
               : NULL;
}

static enum stream_state state_on_path(const struct stream *stream, const struct machine *machine)
{
    const struct chunk *next = chunk_after_rest(stream, machine);
    if (next == NULL) {
        return machine_waits_for_chunk(machine) ? STREAM_UNDERRUN : STREAM_OPEN;
    }
    return stream->stopped_for == next->sequence && machine->state != MACHINE_RUNNING
               ? STREAM_PROGRAM_STOP
               : STREAM_OPEN;
}

static enum stream_state state_of(const struct stream *stream, const struct machine *machine)
{
    const bool at_end = feed_override_state(&machine->motion.feed) == FEED_ENDED;
    if (machine_on_path(machine)) {
        return state_on_path(stream, machine);
    }
    return at_end && !chunk_goes_on(&stream->executed->chunk) && machine->state != MACHINE_FAULT
               ? STREAM_ENDED
               : STREAM_STOPPED;
}

/* Notes changes of the job since the last round. */
static void note_state(struct stream *stream, const struct machine *machine)
{
    port_lock();
    stream->state = state_of(stream, machine);
    port_unlock();
    if (stream->state == STREAM_UNDERRUN && !stream->waits) {
        stream->waits = true;
        stream->underruns++;
        port_log(PORT_NOTE, "underrun: waits for chunk", (int32_t)stream->wanted);
    }
    if (is_over(stream) && stream->receiving == NULL) {
        drop_chunks(stream);
    }
}

/* Holds the path before a chunk with a program stop, once. */
static void stop_before_next(struct stream *stream, struct machine *machine)
{
    const struct chunk *next = chunk_after_rest(stream, machine);
    const uint32_t wanted = CHUNK_REST_STOP | (stream->optional_stop ? CHUNK_REST_OPTIONAL : 0u);
    if (next != NULL && (next->rest_flags & wanted) != 0u &&
        stream->stopped_for != next->sequence && machine->state == MACHINE_RUNNING) {
        stream->stopped_for = next->sequence;
        (void)machine_hold(machine);
    }
}

static bool take_next_over(struct stream *stream, struct machine *machine)
{
    struct stream_chunk *next = stream->executed->next;
    if (next == NULL) {
        return false;
    }
    const struct coefficients_window *window =
        chunk_records_for_next(&stream->records, machine, &next->chunk);
    port_lock();
    stop_before_next(stream, machine);
    const bool taken = window != NULL && machine_take_over(machine, &next->chunk, window);
    port_unlock();
    if (taken) {
        chunk_records_taken_over(&stream->records);
        chunk_ring_free_oldest(&stream->ring, (const uint8_t *)next);
        stream->waits = false;
        enter(stream, next);
    }
    return taken;
}

void stream_process(struct stream *stream, struct machine *machine)
{
    bool again = stream->started;
    while (again && stream->executed != NULL) {
        note_state(stream, machine);
        again = stream->executed != NULL && !is_over(stream);
        if (again) {
            chunk_records_go_on(&stream->records, machine, &stream->executed->chunk.program);
            again = take_next_over(stream, machine);
        }
    }
}

/* ---- State of the job ---- */

uint32_t stream_hold_worst_us(const struct stream *stream)
{
    return stream->executed != NULL ? stream->executed->chunk.program.header.hold_worst_us : 0u;
}

uint32_t stream_free_bytes(const struct stream *stream)
{
    const uint32_t room = chunk_ring_room(&stream->ring);
    return room > HEAD_SIZE ? room - HEAD_SIZE : 0u;
}

static uint64_t time_now_q32_s(const struct stream *stream, const struct machine *machine)
{
    const struct motion *motion = &machine->motion;
    if (!stream->started) {
        return stream->place.job_time_q32_s;
    }
    return stream->place.job_time_q32_s + motion_time_q32_s(motion) -
           ticks_q32_s(motion->rest_ticks, machine->config.period_us);
}

/* Below 2^22 s. */
static uint32_t ms_of(int64_t time_q32_s)
{
    return time_q32_s <= 0 ? 0u : (uint32_t)(((uint64_t)time_q32_s >> 16) * 1000u >> 16);
}

uint32_t stream_committed_ms(const struct stream *stream, const struct machine *machine)
{
    const struct stream_chunk *newest = stream->newest;
    if (newest == NULL) {
        return 0;
    }
    const uint64_t end_q32_s = newest->job_time_q32_s + newest->chunk.program.header.duration_q32_s;
    return ms_of((int64_t)(end_q32_s - time_now_q32_s(stream, machine)));
}

int64_t stream_arc_length_q40_mm(const struct stream *stream, const struct machine *machine)
{
    return stream->place.job_start_q40_mm +
           (stream->started ? machine->motion.point.arc_length_q40_mm : 0);
}

uint32_t stream_remaining_ms(const struct stream *stream, const struct machine *machine)
{
    const struct stream_chunk *newest = stream->newest;
    if (newest == NULL || newest->chunk.remaining_ms == CHUNK_TIME_UNKNOWN) {
        return stream->state == STREAM_ENDED ? 0u : CHUNK_TIME_UNKNOWN;
    }
    const uint64_t now_q32_s = time_now_q32_s(stream, machine);
    const uint64_t joint_q32_s = newest->joint_time_q32_s;
    if (now_q32_s <= joint_q32_s) {
        return newest->chunk.remaining_ms + ms_of((int64_t)(joint_q32_s - now_q32_s));
    }
    const uint32_t passed_ms = ms_of((int64_t)(now_q32_s - joint_q32_s));
    return newest->chunk.remaining_ms > passed_ms ? newest->chunk.remaining_ms - passed_ms : 0u;
}
