/* SPDX-License-Identifier: MIT */
/*
 * feed_piece: evaluates a feed piece in integers: arc length, feed and acceleration at a time (docs/theory/numerics.md
 * section 9, "Feed"). Used by firmware/core: the kernels fixed and float, and program_time. Writes only its arguments;
 * feed_piece_set and program_time in the main loop, otherwise in the tick.
 */
#ifndef HODOGRAPH_CORE_FEED_PIECE_H
#define HODOGRAPH_CORE_FEED_PIECE_H

#include <stdint.h>

#include "core/program.h"

struct feed_piece {
    int64_t start_q40_mm;
    int64_t c_q44_mm[7];
    /* Derivative by tau: its coefficients are slope[k] 2^slope_shift in q44 mm. */
    int32_t slope[7];
    int32_t slope_shift;
    /* Feed in q32 mm/s = (slope >> feed_right_shift) * feed_factor. One of them is neutral: 0, or 1. */
    int32_t feed_factor;      /* 2^0 ... 2^30, or 2^31 - 1 where the feed saturates */
    int32_t feed_right_shift; /* 0 ... 31 */
    int32_t exponent;         /* tau = t / 2^exponent */
};

struct feed_point {
    int64_t arc_length_q40_mm; /* from the start of the program */
    int64_t feed_q32_mm_s; /* below 2^62; too low where coefficients sum up to 2^30 mm/s or more */
};

/* The functions have the types of struct kernel: `piece` is a struct feed_piece. */

void feed_piece_set(void *piece, const struct program_piece *from);

/* At local time t, 0 <= t < duration. Arc length within 2^-40.4 mm of the polynomial (half a unit and the Horner
 * steps), feed within 14 units of `slope`, 2^-30 of the sum of its coefficients. Seven wide products and eight narrow
 * ones, no division. */
void feed_piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s);

/* F'' at local time t, in 2^-40 mm/s^2, held within +-(2^62 - 1): for the start of a path stop (core/feed_override).
 * Within 2^-27 of the greatest F' of the coefficients, divided by the time scale of the piece. */
int64_t feed_piece_acceleration(const void *piece, uint64_t t_q42_s);

#endif
