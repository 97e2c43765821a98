/* SPDX-License-Identifier: MIT */
/*
 * Evaluating a feed piece in integers: arc length and feed at a time (docs/theory/numerics.md section 9,
 * "Feed"). Used by the fixed and the float kernel. Pure, tick context.
 */
#ifndef HODOGRAPH_CORE_FEED_PIECE_H
#define HODOGRAPH_CORE_FEED_PIECE_H

#include <stdint.h>

#include "core/program.h"

struct feed_piece {
    int64_t start_q40_mm;
    int64_t c_q44_mm[7];
    int32_t slope[7];    /* coefficients of the derivative in tau, */
    int32_t slope_shift; /* 2^slope_shift times these in q44 */
    int32_t feed_factor; /* these in 2^-32 mm/s: times 2^0 ... 2^30, */
    int32_t feed_drop;   /* or without so many bits */
    int32_t exponent;    /* tau = t / 2^exponent */
};

struct feed_point {
    int64_t arc_length_q40_mm; /* from the start of the program */
    int64_t feed_q32_mm_s; /* below 2^62; too low where coefficients sum up to 2^30 mm/s or more */
};

/* The functions have the types of struct kernel: `piece` is a struct feed_piece. */

void feed_piece_set(void *piece, const struct program_piece *from);

/* At local time t, 0 <= t < duration. Arc length within 2^-40.4 mm of the polynomial (half a unit
 * and the Horner steps), feed within 14 units of `slope`, 2^-30 of the sum of its
 * coefficients. Seven wide products and eight narrow ones, no division. */
void feed_piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s);

/* F'' at local time t, in 2^-40 mm/s^2, held within +-(2^62 - 1): for the begin of a brake (core/feed_override). Within
 * 2^-27 of the greatest F' of the coefficients, divided by the time scale of the piece. */
int64_t feed_piece_acceleration(const void *piece, uint64_t t_q42_s);

#endif
