/* SPDX-License-Identifier: MIT */
/*
 * feed_bounds: feed, acceleration and jerk of a feed piece: values at its ends and bounds over it, in integers of
 * physical units. Used by the checks of a program. Derivation: docs/theory/numerics.md section 9, "Checking". Pure,
 * main loop.
 */
#ifndef HODOGRAPH_CORE_FEED_BOUNDS_H
#define HODOGRAPH_CORE_FEED_BOUNDS_H

#include <stdint.h>

#include "core/program.h"

/* Values beyond 2^62 units are limited to 2^62. */
struct feed_state {
    int64_t arc_length_q44_mm; /* relative to the piece's start */
    int64_t feed_q24_mm_s;
    int64_t acceleration_q16_mm_s2;
};

/* At the start and the end of a piece with |c| <= 2^14 mm, 0 < duration <= 2^22 s. */
void feed_bounds_start(const struct program_piece *piece, struct feed_state *out);
void feed_bounds_end(const struct program_piece *piece, struct feed_state *out);

/* A feed this far below 0 is rounding, not motion; slower ones count as this one: 2^-10 mm/s. */
#define FEED_LEAST_Q24 ((int64_t)1 << 14)
/* Beyond any feed, acceleration or jerk. */
#define FEED_NO_BOUND_Q24 (INT64_MAX / 64)

enum feed_derivative { FEED_VELOCITY = 1, FEED_ACCELERATION = 2, FEED_JERK = 3 };

/* 1 when that derivative of F stays within [low, high] over the whole piece, in 2^-24 mm/s, mm/s^2 or mm/s^3; 0 when it
 * does not, or when that cannot be decided (within about 1e-5 of its variation). */
int feed_bounds_within(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24, int64_t high_q24);

#define FEED_PARTS 8 /* parts of a piece that have bounds of their own */

/* Bounds of that derivative over each eighth of the piece (in time), their Bernstein coefficients' least and greatest
 * in 2^-24 units, rounded outwards. The greatest are held at +-FEED_NO_BOUND_Q24; the least are -FEED_NO_BOUND_Q24 or
 * more, and below 2^62. */
void feed_bounds_parts(const struct program_piece *piece, enum feed_derivative derivative,
                       int64_t low_q24[FEED_PARTS], int64_t high_q24[FEED_PARTS]);

/* By this distance the arc length of a piece may be below that of its start or above that of its end: 2^-14 mm. The
 * exponential ramp begins with a step back of some 2e-8 of feed times ramp time (docs/theory/numerics.md section 9). */
#define FEED_PIECE_SLACK_Q36 ((int64_t)1 << 22)

/* 1 when F stays between its values at both ends of the piece, to that slack. This is checked by itself, because a feed
 * that is a little below 0 for long also moves back. For a piece of at most 32 mm. */
int feed_bounds_contained(const struct program_piece *piece);

#endif
