/* SPDX-License-Identifier: MIT */
/*
 * What the pieces ahead allow the rate of program time, by level (docs/reference/protocol.md 1.3), and in the form in which a tick
 * uses it: a move of the rate keeps one pair of bounds, those of the level of its greatest rate, so a way through
 * several levels is made in stages (docs/theory/numerics.md section 12, "Levels"). Integers, no division. Any context.
 */
#ifndef HODOGRAPH_CORE_RATE_PACE_H
#define HODOGRAPH_CORE_RATE_PACE_H

#include <stdint.h>

#include "core/program.h"

#define RATE_WINDOWS 5u /* windows of 1, 2, 4, 8, 16 pieces */

#define RATE_ONE ((int64_t)1 << 57)
#define RATE_SPARE                                                                                 \
    ((int64_t)1 << 37) /* 10^-6: what a way may leave of itself, but for bounds next to nothing */

/* With R and S the bounds of slope and second difference, in 2^-56 a tick and a tick squared: R from 2^30, S from 2^28,
 * both up to 2^56. */
struct rate_pace {
    uint32_t turns;         /* at least R / S: ticks in which the slope comes to R */
    uint32_t inverse_slope; /* 2^61 / R, rounded up */
    uint32_t inverse_root;  /* 2^45 / sqrt(S), rounded up */
};

/* The next rest on a way, and the level whose bounds hold until there. */
struct rate_stage {
    int64_t goal_q57;
    uint32_t level;
};

/* Number of pieces in a window. */
static inline uint32_t rate_window_pieces(uint32_t window)
{
    return (uint32_t)1 << window;
}

/* Least of the bounds of pieces first ... first + count - 1, as many of them as the program has; one at least. */
void rate_bounds_of(struct program_override *out, const struct program *p, uint32_t first,
                    uint32_t count);

/* The first stage from one rate to another. Levels whose bounds are alike are one. */
void rate_stage_of(struct rate_stage *out, const struct program_override *bounds, int64_t from_q57,
                   int64_t to_q57);

/* Pace of a level (codes above 0). period_log2: 0 ... 3 for a period of 1, 2, 4, 8 ms. */
void rate_pace_of(struct rate_pace *out, const struct program_override *bounds, uint32_t level,
                  uint32_t period_log2);

#endif
