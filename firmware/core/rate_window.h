/* SPDX-License-Identifier: MIT */
/*
 * The feed pieces ahead, as far as a move of the rate will run into them (docs/theory/numerics.md section 12, "Look-ahead windows").
 * Tick context.
 */
#ifndef HODOGRAPH_CORE_RATE_WINDOW_H
#define HODOGRAPH_CORE_RATE_WINDOW_H

#include <stdint.h>

#include "core/rate_pace.h"

struct timebase;

/* The pieces from one on: rate_window_pieces(window) of them, or to the end of the program. */
struct rate_window {
    const struct program_override *bounds; /* of all pieces in it */
    uint64_t end_q32_s;                    /* UINT64_MAX with the last piece */
    struct program_override own;           /* `bounds` of a program without prepared records */
};

/* The window of this number (below RATE_WINDOWS) from the present piece of *tb on. Constant time with prepared records
 * (core/prepared.h), else it looks at each piece. */
void rate_window_get(struct rate_window *w, const struct timebase *tb, uint32_t window);

#endif
