/* SPDX-License-Identifier: MIT */
#include "offline/stream.h"

#include <stddef.h>

#include "core/counts.h"

int offline_stream_begin(struct offline_stream *stream, const struct chunk *first)
{
    stream->axis_count = first->program.header.axis_count;
    feed_override_begin_job(&stream->feed, first, first->program.header.period_us);
    return interpolator_begin(&stream->interp, &first->program);
}

int offline_stream_run(struct offline_stream *stream, const struct chunk *next, uint32_t n,
                       uint32_t counts_per_mm, int32_t *counts, uint32_t *taken)
{
    const uint32_t axes = stream->axis_count;
    *taken = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (next != NULL && *taken == 0u) {
            *taken = (uint32_t)feed_override_take_over(&stream->feed, &stream->interp, next);
        }
        struct interpolator_point point;
        const int code = feed_override_next(&stream->feed, &stream->interp, &point);
        if (code < 0) {
            return code;
        }
        for (uint32_t axis = 0; axis < axes; axis++) {
            counts[axes * (size_t)i + axis] =
                counts_from_q40_mm(point.position_q40[axis], counts_per_mm);
        }
        if (*taken != 0u || feed_override_state(&stream->feed) == FEED_ENDED) {
            return (int)(i + 1u);
        }
    }
    return (int)n;
}
