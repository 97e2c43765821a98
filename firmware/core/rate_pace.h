/* SPDX-License-Identifier: MIT */
/*
 * What the pieces ahead allow the rate of program time, in the form in which a tick uses it: nothing is left to divide
 * (docs/numerics.md section 12, "One move at a time"). Made in the main loop, with the prepared records.
 */
#ifndef HODOGRAPH_CORE_RATE_PACE_H
#define HODOGRAPH_CORE_RATE_PACE_H

#include <stdint.h>

#include "core/program.h"

#define RATE_WINDOWS 5u /* windows of 1, 2, 4, 8, 16 pieces */

/* Override bounds as in struct program_piece, all above 0. */
struct rate_bounds {
    uint32_t factor_q24;
    uint32_t rate_q16_per_s;
    uint32_t second_q8_per_s2;
};

/* With R and S the bounds of slope and second difference, in 2^-56 a tick and a tick squared: R from 2^30, S from 2^28,
 * both up to 2^56. */
struct rate_pace {
    uint32_t factor_q24;
    uint32_t turns;         /* ceil(R / S): ticks in which the slope comes to R */
    uint32_t inverse_slope; /* 2^61 / R, rounded up */
    uint32_t inverse_root;  /* 2^45 / sqrt(S), rounded up */
};

/* Number of pieces in a window. */
static inline uint32_t rate_window_pieces(uint32_t window)
{
    return (uint32_t)1 << window;
}

/* Least of the bounds of pieces first ... first + count - 1, as many of them as the program has; one at least. */
void rate_bounds_of(struct rate_bounds *out, const struct program *p, uint32_t first,
                    uint32_t count);

/* period_us: 1000, 2000, 4000 or 8000. */
void rate_pace_make(struct rate_pace *out, const struct rate_bounds *bounds, uint32_t period_us);

#endif
