/* SPDX-License-Identifier: MIT */
/*
 * chunk: reads and checks a chunk, a part of a job that is longer than the memory of the controller
 * (docs/reference/protocol.md 1.7). Used by firmware/app, core/feed_override, sim/offline/stream and host tools.
 * Changes only its arguments; no I/O.
 *
 * Each chunk holds a whole program, which ends at rest: its last pieces are a tail that brakes along the path, inside
 * the limits of the program. The next chunk begins inside its predecessor. It repeats the pieces and segments up to the
 * joint, where that tail begins, with the same numbers; its other pieces begin at the joint. The controller takes it
 * over while the motion is in the shared part (feed_override_take_over). If there is no next chunk in time, the motion
 * follows the tail and rests on the path. Events are shared like segments: both chunks have those up to the end of the
 * predecessor. So each event acts once, whichever chunk the motion passes it with.
 *
 * A chunk with flag REST shares nothing: it begins at rest, where its predecessor ends, after a dwell or a program
 * stop. So paths with exact stops between them are one job.
 *
 * A chunk is never copied; its bytes must stay unchanged as long as a struct chunk refers to them. No heap, no globals.
 * chunk_open and chunk_check: main loop. The inline functions are pure, any context.
 */
#ifndef HODOGRAPH_CORE_CHUNK_H
#define HODOGRAPH_CORE_CHUNK_H

#include <stdint.h>

#include "core/interpolator.h"
#include "core/program.h"
#include "core/program_rules.h"

#define CHUNK_HEADER_SIZE   80u
#define CHUNK_VERSION       2u
#define CHUNK_FLAG_FIRST    1u /* the job begins with it, at rest */
#define CHUNK_FLAG_LAST     2u /* the job ends with it: it has no tail */
#define CHUNK_FLAG_REST     4u /* it begins at rest where its predecessor ends */
#define CHUNK_FLAG_JOINED   8u /* it has no tail: the next chunk has flag REST */
#define CHUNK_REST_STOP     1u /* of rest_flags: a program stop before it */
#define CHUNK_REST_OPTIONAL 2u /* an optional one */
#define CHUNK_REST_TICKS    8u /* the shortest rest before a chunk with flag REST */
#define CHUNK_TIME_UNKNOWN  UINT32_MAX
/* Pieces of the longest look-ahead window (core/override_plan.h). With so many shared pieces a ramp that keeps the
 * bounds of a window evaluated before the shared part ends before the joint, and does not delay the takeover. Two kinds
 * of ramps may still end after the joint: those for which no window is long enough, which keep the least bounds of the
 * program, and those whose window was evaluated in the shared part. They delay the takeover until their own end, or
 * until the rest at the end of the tail. */
#define CHUNK_SHARED_PIECES 16u

struct chunk {
    /* The header, as in protocol.md 1.7. */
    uint32_t flags; /* CHUNK_FLAG_... */
    uint32_t size;  /* bytes of header and image */
    uint32_t job;
    uint32_t sequence;
    uint32_t piece_shift;   /* number in the predecessor of piece 0, */
    uint32_t segment_shift; /* and of segment 0 */
    /* the first pieces, which are the predecessor's; the joint is at their end */
    uint32_t shared_pieces;
    uint32_t shared_segments;
    int64_t arc_shift_q40_mm;  /* arc length in the predecessor of arc length 0, */
    uint64_t time_shift_q32_s; /* and program time in it of time 0 */
    int64_t job_start_q40_mm;  /* arc length of the job at arc length 0 */
    uint32_t line;             /* of the source at its start; 0: none */
    uint32_t remaining_ms;     /* of the job from the joint on; CHUNK_TIME_UNKNOWN */
    uint32_t rest_ms;          /* dwell before it starts */
    uint32_t rest_flags;       /* CHUNK_REST_STOP, CHUNK_REST_OPTIONAL */
    struct program program;
    /* What a takeover needs of the whole program, made by chunk_check: */
    uint64_t joint_time_q32_s;     /* program time of the joint in the predecessor, */
    struct program_override least; /* the least override bounds of its pieces, */
    struct interpolator_point end; /* and its exact end point */
};

/* Opens a chunk of `size` bytes: magic, version, size, flags, CRC, and the program in it (program_open). The buffer may
 * be longer than the size in the header, never shorter. Cost: two CRCs, linear in the size. Returns 0 or a negative
 * enum program_error; *c is then not usable. */
int chunk_open(struct chunk *c, const uint8_t *bytes, uint32_t size);

/* Checks an opened chunk: its whole program (program_check), and that it continues its predecessor, which has passed
 * this check; NULL for the first. Returns 0, or the code of the first rule broken; *fault gets the same code and its
 * index. Cheap checks come first. Linear. */
int chunk_check(struct chunk *next, const struct chunk *previous,
                const struct program_limits *limits, struct program_fault *fault);

/* 1: the job continues after this chunk's program. */
static inline int chunk_goes_on(const struct chunk *c)
{
    return (c->flags & CHUNK_FLAG_LAST) == 0u;
}

/* 1: the chunk shares nothing and begins at rest where its predecessor ends. */
static inline int chunk_begins_at_rest(const struct chunk *c)
{
    return (c->flags & CHUNK_FLAG_REST) != 0u;
}

/* 1: the end of the chunk is a rest of the job, not the end of a tail. */
static inline int chunk_is_joined(const struct chunk *c)
{
    return (c->flags & CHUNK_FLAG_JOINED) != 0u;
}

/* Ticks of rest before a chunk that begins at rest: setpoints that repeat the end of its predecessor. */
static inline uint32_t chunk_rest_ticks(const struct chunk *c)
{
    const uint32_t period_ms = c->program.header.period_us / 1000u;
    const uint32_t ticks = c->rest_ms / period_ms + (c->rest_ms % period_ms != 0u ? 1u : 0u);
    return ticks > CHUNK_REST_TICKS ? ticks : CHUNK_REST_TICKS;
}

#endif
