/* SPDX-License-Identifier: MIT */
/*
 * Contracts of the functions of core/feed_bounds.h: what they require of a feed piece and what they ensure.
 * eva_bounds.c proves them; eva_piece.c, eva_segment_length.c and eva_stops.c assume them. Included by these four
 * files. Declarations with contracts (ACSL) and predicates only; never executed, touches nothing.
 */
#ifndef HODOGRAPH_PIECE_BOUNDS_H
#define HODOGRAPH_PIECE_BOUNDS_H

#include "core/feed_bounds.h"
#include "core/program.h"

/* clang-format off */
/*@ predicate in_range(struct program_piece *c) =
      1 <= c->duration_q32_s <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[0] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[1] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[2] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[3] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[4] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[5] <= (1 << 54) &&
      -(1 << 54) <= c->c_q40_mm[6] <= (1 << 54);
    predicate fits(integer a) = -(1 << 62) < a < (1 << 62);
    predicate is_low(integer a) = -FEED_NO_BOUND_Q24 <= a < (1 << 62);
    predicate is_high(integer a) = -FEED_NO_BOUND_Q24 <= a <= FEED_NO_BOUND_Q24;
*/
/* clang-format on */

/*@ assigns *out \from *piece;
    ensures \initialized(out) && out->arc_length_q44_mm == 0;
    ensures fits(out->feed_q24_mm_s) && fits(out->acceleration_q16_mm_s2); */
void feed_bounds_start(const struct program_piece *piece, struct feed_state *out);

/*@ requires in_range(piece);
    assigns *out \from *piece;
    ensures \initialized(out) && fits(out->arc_length_q44_mm);
    ensures fits(out->feed_q24_mm_s) && fits(out->acceleration_q16_mm_s2); */
void feed_bounds_end(const struct program_piece *piece, struct feed_state *out);

/*@ requires in_range(piece);
    assigns \result \from *piece;
    ensures \result == 0 || \result == 1; */
int feed_bounds_contained(const struct program_piece *piece);

/*@ requires in_range(piece) && 1 <= derivative <= 3;
    assigns \result \from *piece, derivative, low_q24, high_q24;
    ensures \result == 0 || \result == 1; */
int feed_bounds_within(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24, int64_t high_q24);

/*@ requires in_range(piece) && 1 <= derivative <= 3;
    assigns low_q24[0 .. 7], high_q24[0 .. 7] \from derivative;
    ensures \initialized(low_q24 + (0 .. 7)) && \initialized(high_q24 + (0 .. 7));
    ensures is_low(low_q24[0]) && is_low(low_q24[1]) && is_low(low_q24[2]) && is_low(low_q24[3]);
    ensures is_low(low_q24[4]) && is_low(low_q24[5]) && is_low(low_q24[6]) && is_low(low_q24[7]);
    ensures is_high(high_q24[0]) && is_high(high_q24[1]) && is_high(high_q24[2]) && is_high(high_q24[3]);
    ensures is_high(high_q24[4]) && is_high(high_q24[5]) && is_high(high_q24[6]) && is_high(high_q24[7]); */
void feed_bounds_parts(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24[FEED_PARTS], int64_t high_q24[FEED_PARTS]);

#endif
