/* SPDX-License-Identifier: MIT */
/*
 * Evaluating a feed piece in integers: arc length and feed at a time (docs/numerics.md section 9,
 * "Feed"). Used by the fixed and the float kernel. Pure, tick context.
 */
#ifndef HODOGRAPH_CORE_FEED_PIECE_H
#define HODOGRAPH_CORE_FEED_PIECE_H

#include <stdint.h>

#include "core/program.h"

struct feed_piece {
    int64_t start_q40_mm;
    int64_t c_q44_mm[7];
    int exponent; /* tau = t / 2^exponent */
};

struct feed_point {
    int64_t arc_length_q40_mm; /* from the start of the program */
    int64_t feed_q32_mm_s;     /* held within 2^62, which only absurd programs reach */
};

void feed_piece_set(struct feed_piece *f, const struct program_piece *piece);

/* At local time t, 0 <= t < duration. Arc length within 2^-40.4 mm of the polynomial (half a unit
 * and the Horner steps), feed within 2^-40 mm / 2^exponent s + 2^-32 mm/s. Fourteen wide products,
 * no division. */
void feed_piece_at(const struct feed_piece *f, uint64_t t_q42_s, struct feed_point *out);

/* The same two for struct kernel: `piece` is a struct feed_piece. */
void feed_piece_make(void *piece, const struct program_piece *from);
void feed_piece_point(const void *piece, uint64_t t_q42_s, struct feed_point *out);

#endif
