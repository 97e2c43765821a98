/* SPDX-License-Identifier: MIT */
/*
 * stream: simulates a job in chunks without a bus, as the controller handles chunks at any time of their arrival
 * (docs/reference/protocol.md 1.7). Called by host_tools/hodograph/native. Chunks are opened, checked and taken over by
 * the code of the controller, one attempt before each tick; commands are those of the feed override. Dwells between
 * chunks take their ticks, program stops no time. Setpoints are those of the controller, bit for bit. Records exist
 * only near the motion, as in the controller (core/coefficient_cache.h); they are made before each tick. Changes only
 * its struct and the lent memory; no I/O.
 *
 * Use: offline_stream_begin; for each chunk offline_stream_check and offline_stream_add, before its tick; and
 * offline_stream_run in between. No heap: the caller lends memory for records, and a struct offline_part and the bytes
 * of each chunk, which have to stay until a later chunk is executed (`active`). One thread for each stream.
 */
#ifndef HODOGRAPH_OFFLINE_STREAM_H
#define HODOGRAPH_OFFLINE_STREAM_H

#include <stdint.h>

#include "core/chunk.h"
#include "core/coefficient_cache.h"
#include "core/feed_override.h"
#include "core/interpolator.h"
#include "core/kernel.h"
#include "core/path_outputs.h"

/* A chunk that was given. */
struct offline_part {
    struct chunk chunk;
    struct offline_part *next; /* the chunk accepted after it */
};

struct offline_stream {
    const struct kernel *kernel;
    struct program_limits limits;
    struct feed_override feed; /* its commands may be called between ticks */
    struct interpolator interp;
    struct coefficient_cache cache;
    struct path_outputs outputs; /* at the last setpoint */
    struct offline_part *active; /* NULL before the first chunk, */
    struct offline_part *newest; /* and the last one accepted */
    uint64_t ticks;
    uint32_t moving;                /* takeovers in motion, */
    uint32_t resting;               /* and at rest */
    uint32_t underruns;             /* rests at the end of a tail */
    uint32_t rested;                /* 1: at such a rest at the last tick */
    uint32_t rest_ticks;            /* before a chunk that begins at rest, */
    uint32_t waited_ticks;          /* and at the end of its predecessor, without it */
    struct interpolator_point last; /* setpoint, with the arc length of the job */
};

/* `memory`: that of the cache, aligned to COEFFICIENTS_ALIGNMENT; a small controller has 8 KiB. */
void offline_stream_begin(struct offline_stream *s, const struct kernel *kernel,
                          const struct program_limits *limits, uint8_t *memory, uint32_t size);

/* Opens and checks a chunk as the successor of the newest accepted one. 0, or enum program_error, also in *fault: the
 * stream has not changed, and the chunk may be given again. */
int offline_stream_check(const struct offline_stream *s, struct offline_part *part,
                         const uint8_t *bytes, uint32_t size, struct program_fault *fault);

/* Accepts a chunk that has just passed offline_stream_check. The first one begins the motion. 0, or
 * COEFFICIENTS_ERR_SIZE: the cache is too small. */
int offline_stream_add(struct offline_stream *s, struct offline_part *part);

/* Executes up to `count` ticks. It ends earlier if the job has ended or was stopped, and with `until_rest` at the end
 * of a tail without a next chunk. Points have arc lengths of the job; `values`, if not NULL, are the outputs at them.
 * Returns the number of ticks, or a negative INTERPOLATOR_ERR_.... */
int64_t offline_stream_run(struct offline_stream *s, uint32_t count, uint32_t until_rest,
                           struct interpolator_point *points, struct path_outputs_values *values);

#endif
