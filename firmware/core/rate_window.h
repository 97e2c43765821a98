/* SPDX-License-Identifier: MIT */
/*
 * The feed pieces ahead, as far as a transition of the rate will run into them: the tightest of
 * their override bounds (docs/numerics.md section 12, "Windows"). Bounded time; tick context.
 */
#ifndef HODOGRAPH_CORE_RATE_WINDOW_H
#define HODOGRAPH_CORE_RATE_WINDOW_H

#include <stdint.h>

#include "core/program.h"
#include "core/rate.h"

#define RATE_WINDOW_LEVELS 5u /* windows of 1, 2, 4, 8, 16 pieces */

/* From a physical bound of a piece to one per tick; from rate_scale_set. */
struct rate_scale {
    uint64_t slope;
    uint64_t second;
    uint32_t most_rate_q16; /* above it the bound is RATE_SLOPE_MOST */
    uint32_t most_second_q8;
};

/* The pieces from one on, 2^level of them or to the end of the program. */
struct rate_window {
    struct rate_bounds bounds; /* of all pieces in it */
    uint64_t end_q32_s;        /* UINT64_MAX with the last piece */
};

/* period_us: 1000, 2000, 4000 or 8000. */
void rate_scale_set(struct rate_scale *scale, uint32_t period_us);

/* Bounds of one piece, rounded down. */
void rate_window_piece(const struct rate_scale *scale, const struct program *p, uint32_t i,
                       struct rate_bounds *out);

/* The window from piece i, which ends at end_q32_s. Constant time with prepared records (core/prepared.h), else it looks
 * at each piece. */
void rate_window_get(struct rate_window *w, const struct rate_scale *scale, const struct program *p,
                     uint32_t i, uint64_t end_q32_s, uint32_t level);

#endif
