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

#define RATE_WINDOW_PIECES 16u /* looked at, at most */

/* From a physical bound of a piece to one per tick; from rate_scale_set. */
struct rate_scale {
    uint64_t slope;
    uint64_t second;
    uint32_t most_rate_q16; /* above it the bound is RATE_SLOPE_MOST */
    uint32_t most_second_q8;
};

struct rate_window {
    const struct program *program;
    const struct rate_scale *scale;
    struct rate_bounds bounds; /* of all pieces in it; never looser than the pieces' own */
    uint64_t end_q32_s;        /* UINT64_MAX with the last piece */
    uint32_t next;             /* the first piece beyond */
    uint32_t pieces;
};

/* period_us: 1000, 2000, 4000 or 8000. */
void rate_scale_set(struct rate_scale *scale, uint32_t period_us);

/* Bounds of one piece, rounded down. */
void rate_window_piece(const struct rate_scale *scale, const struct program *p, uint32_t i,
                       struct rate_bounds *out);

/* A window of the one piece that ends at end_q32_s and has these bounds. */
void rate_window_open(struct rate_window *w, const struct program *p,
                      const struct rate_scale *scale, uint32_t piece, uint64_t end_q32_s,
                      const struct rate_bounds *bounds);

/* Takes one more piece in. 1; 0 when RATE_WINDOW_PIECES are in. */
int rate_window_extend(struct rate_window *w);

#endif
