/* SPDX-License-Identifier: MIT */
/*
 * path_motion: the motion of the path axes on one segment: velocity, acceleration and jerk of each axis at an instant,
 * and a bound of their second derivatives over a stretch. Used by the proofs of axis limits (core/limit_check.h,
 * core/brake_check.h); docs/theory/proofs.md section 16 has the formulas.
 *
 * A feed polynomial gives arc length in powers of x, which stands for time from -1 to 1 in some unit; `per_s` is dx/dt.
 * With s = middle + half x and per_s = 1 / half the motion is that at 1 mm/s: velocity, acceleration and jerk then are
 * the first three derivatives of the axis by arc length.
 *
 * Integers only (core/real.h). Pure functions, main loop.
 */
#ifndef HODOGRAPH_CORE_PATH_MOTION_H
#define HODOGRAPH_CORE_PATH_MOTION_H

#include "core/program.h"
#include "core/program_rules.h"
#include "core/real.h"

#define FEED_DEGREE 7
#define PATH_DEGREE 4 /* of sigma and of the derivatives of all axes */

enum quantity { VELOCITY, ACCELERATION, JERK, QUANTITIES };

/* One segment: polynomials in xi. */
struct path {
    int64_t start_q40_mm;
    struct real length_mm;
    uint32_t axis_count;
    struct real w[PROGRAM_PLANE][3]; /* of a planar program */
    struct real sigma[PATH_DEGREE + 1];
    struct real arc[PATH_DEGREE + 1];                     /* (arc length from the start) / xi */
    struct real direction[PROGRAM_AXES][PATH_DEGREE + 1]; /* derivatives of the axes */
    struct real least_sigma;
};

/* One feed piece: F in mm from its start, in powers of u = time / duration. */
struct feed_polynomial {
    struct real c[FEED_DEGREE + 1];
    struct real per_s; /* 1 / duration */
    struct program_override override;
    int64_t start_q40_mm;
    struct real end_mm;
};

/* Velocity, acceleration and jerk of each axis at an instant, at override 100 %. */
struct motion {
    struct real of[PROGRAM_AXES][QUANTITIES];
};

/* Limits of the path axes of a program in mm and s; m = 0: none. Less 2^-14 of each, for the rounding of numbers here.
 * Returns 0 where there is none at all. */
int path_motion_limits(struct motion *out, const struct program_limits *limits,
                       uint32_t axis_count);

/* All of them 0. */
void path_motion_clear(struct motion *out);

/* c(x), by Horner. */
struct real path_motion_horner(const struct real *c, int degree, struct real x);

/* The first `count` coefficients of c become those of its Taylor series at `at`; at most `degree` of them. */
void path_motion_taylor(struct real *c, int degree, struct real at, int count);

/* c(x) becomes c(x + by), and c(by x). */
void path_motion_shift(struct real *c, int degree, struct real by);
void path_motion_stretch(struct real *c, int degree, struct real by);

/* Segment i of a program that keeps the rules of protocol.md 1.2. */
void path_motion_read(struct path *path, const struct program *p, uint32_t i);

/* Feed piece i of a program that keeps the rules of protocol.md 1.3. */
void path_motion_read_piece(struct feed_polynomial *poly, const struct program *p, uint32_t i);

/* At an arc length of the segment, with the first three derivatives of arc length in time; the curve is continued
 * beyond its ends. Sets the program's axes. */
void path_motion_at(const struct path *path, struct real s_mm, const struct real f[QUANTITIES],
                    struct motion *out);

/* Bounds of |q''| in x of velocity, acceleration and jerk of each axis, in their units of time, for the feed polynomial
 * c from x = -1 to 1; `offset_mm` is what c is counted from, on the segment. */
void path_motion_bend(const struct path *path, const struct real c[FEED_DEGREE + 1],
                      struct real per_s, struct real offset_mm, struct motion *out);

#endif
