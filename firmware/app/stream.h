/* SPDX-License-Identifier: MIT */
/*
 * stream: a job in chunks (object 0x2060), which may be longer than any memory (core/chunk.h,
 * docs/reference/protocol.md 1.7). Called by app/objects_stream, app/objects_program, app/commands and
 * app/controller.c. Main loop; takes the port's lock where it reads or changes the machine. Changes its struct and the
 * port's memory for chunks, and prints by port_log.
 *
 * Chunks are downloaded in order to a ring in RAM, and checked as strictly as a program. Coefficient records exist only
 * near the motion (app/chunk_records.h). In every tick the motion follows one chunk, a whole program that ends at rest.
 * While the motion is in the part that the next chunk shares, or rests, the next chunk is taken over, and the memory of
 * its predecessor is free. So if the bus or the host fails, the motion stays on the path: it comes to rest at the end
 * of a tail (an underrun), and continues when the next chunk has come.
 *
 * A chunk that begins at rest, after a dwell, is taken over at the end of its predecessor; the motion counts the ticks
 * until it starts. Before a program stop the path is held once, until a resume.
 *
 * A job is opened by a first chunk, and started once, by command start. It is over when it has ended, has been stopped
 * or has met a fault. It can be read until it is closed, another one is opened, a program is uploaded, or the power is
 * switched off. A job is bound to the configuration that it was checked under.
 */
#ifndef APP_STREAM_H
#define APP_STREAM_H

#include <stdbool.h>
#include <stdint.h>

#include "app/chunk_records.h"
#include "app/chunk_ring.h"
#include "app/machine/config.h"
#include "app/machine/machine.h"
#include "core/chunk.h"

/* Values of object 0x2060 sub 2. */
enum stream_state {
    STREAM_NONE = 0,         /* no job */
    STREAM_OPEN = 1,         /* a job has its first chunk; it may be running */
    STREAM_UNDERRUN = 2,     /* rest at the end of a tail: the next chunk is missing */
    STREAM_ENDED = 3,        /* the last chunk has been executed to its end */
    STREAM_STOPPED = 4,      /* over before its end: stopped, or a fault */
    STREAM_PROGRAM_STOP = 5, /* at rest before a chunk with a program stop, until resumed */
};

/* The place of a job; kept after its chunks have been freed. */
struct stream_place {
    uint32_t sequence; /* of the chunk that is executed; before the start, of the first one */
    uint32_t line;
    int64_t job_start_q40_mm;
    uint64_t job_time_q32_s; /* time of the job at program time 0 of this chunk */
};

struct stream_chunk; /* a chunk in the ring */

/* Read the fields; private from `ring` on. */
struct stream {
    uint32_t job;                 /* 0: none */
    uint32_t wanted;              /* sequence of the next chunk: all before it have been accepted */
    struct program_fault refused; /* last refusal; code 0: none */
    uint32_t underruns;           /* since the job was opened */
    struct stream_place place;
    /* Called with `self` at each step of the check of a chunk. May be NULL. */
    void (*attend)(void *self);
    void *self;

    struct chunk_ring ring;
    struct chunk_records records;
    struct stream_chunk *executed; /* NULL: no chunks are kept */
    struct stream_chunk *newest;   /* accepted last; executed ... newest are linked */
    uint8_t *receiving;            /* the block of the download under way; NULL: none */
    uint32_t receiving_bytes;
    uint32_t config_crc32; /* of the configuration that the job was checked under */
    int32_t start_counts[AXES_MAX];
    bool started;
    bool waits;         /* this underrun has been counted */
    bool optional_stop; /* optional program stops take effect */
    /* sequence of the chunk before which a program stop was made last; 0: none */
    uint32_t stopped_for;
    enum stream_state state;
};

void stream_init(struct stream *stream);

/* A download of a chunk: begin (`size` bytes, 0: not known), write in order, then finish or abandon. Begin and write: 0
 * or PROGRAM_ERR_ROOM, when the chunk does not fit the ring now. Finish checks: 0, or the code that is then in
 * stream->refused; then nothing has changed. */
int stream_begin(struct stream *stream, uint32_t size);
int stream_write(struct stream *stream, uint32_t offset, const uint8_t *data, uint32_t size);
int stream_finish(struct stream *stream, uint32_t size, const struct config *config);
void stream_abandon(struct stream *stream);

/* Forgets the job and frees the ring. Not while it is on the path. */
void stream_close(struct stream *stream);

/* Whether commands start the job instead of the program in the slot. */
static inline bool stream_is_open(const struct stream *stream)
{
    return stream->job != 0u;
}

/* Prepares the start of the job. MACHINE_ACCEPTED, or the reason of the refusal. */
enum machine_refusal stream_prepare(struct stream *stream, const struct config *config,
                                    struct motion *prepared, int32_t start_counts[AXES_MAX]);
/* machine_start has accepted it. */
void stream_started(struct stream *stream);

/* One round: makes records ahead of the motion, takes over the next chunk if possible, notes underrun and end. Short;
 * also to be called from `attend`. */
void stream_process(struct stream *stream, struct machine *machine);

/* The longest hold of the program that is executed, us; 0: no program is. */
uint32_t stream_hold_worst_us(const struct stream *stream);

/* Object 0x2060 subs 7, 8, 11, 12. */
uint32_t stream_free_bytes(const struct stream *stream);
uint32_t stream_committed_ms(const struct stream *stream, const struct machine *machine);
int64_t stream_arc_length_q40_mm(const struct stream *stream, const struct machine *machine);
uint32_t stream_remaining_ms(const struct stream *stream, const struct machine *machine);

#endif
