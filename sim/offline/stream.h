/* SPDX-License-Identifier: MIT */
/*
 * A job in chunks without a bus and without drives: its setpoints, with the takeovers of the controller.
 *
 * Use: offline_stream_begin, then offline_stream_run as often as wanted. No heap: chunks, their images and coefficient
 * records are the caller's; each must outlive the takeover of the next one. Main loop of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STREAM_H
#define HODOGRAPH_OFFLINE_STREAM_H

#include <stdint.h>

#include "core/chunk.h"
#include "core/feed_override.h"
#include "core/interpolator.h"

/* Fields are private but `feed`, to which commands may be given between two calls. */
struct offline_stream {
    struct feed_override feed;
    struct interpolator interp;
    uint32_t axis_count;
};

/* For the first chunk of a job, which chunk_check has accepted and which has coefficient records. Returns 0 or
 * INTERPOLATOR_ERR_.... */
int offline_stream_begin(struct offline_stream *stream, const struct chunk *first);

/* The next ticks, n at most: up to and with the takeover of `next` (NULL: there is none yet), and to the end of the job.
 * Before each tick `next` is offered for takeover; *taken becomes 1 or 0. counts: those of all axes of a setpoint, one
 * setpoint after the other. Returns the number of ticks, or a negative INTERPOLATOR_ERR_.... */
int offline_stream_run(struct offline_stream *stream, const struct chunk *next, uint32_t n,
                       uint32_t counts_per_mm, int32_t *counts, uint32_t *taken);

#endif
