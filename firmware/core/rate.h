/* SPDX-License-Identifier: MIT */
/*
 * The rate of program time (lambda) and how it reaches a target: the second difference is constant
 * within a tick, so the rate is piecewise quadratic and program time piecewise cubic in time.
 * Derivation: docs/numerics.md section 12, "The rate".
 *
 * Units: rate in 2^-57, its slope in 2^-56 a tick, its second difference in 2^-56 a tick squared.
 * A tick that takes the slope from a to b raises the rate by exactly a + b units. Pure functions,
 * integers only, bounded time: a division and a square root each. Tick context.
 */
#ifndef HODOGRAPH_CORE_RATE_H
#define HODOGRAPH_CORE_RATE_H

#include <stdint.h>

#define RATE_ONE        ((int64_t)1 << 57)
#define RATE_MOST       (2 * RATE_ONE)
#define RATE_SLOPE_MOST ((int64_t)1 << 56) /* a bound above this is the same as this */
#define RATE_SPAN_TICKS ((int64_t)1 << 20) /* transitions this long and longer are not told apart */

struct rate {
    int64_t rate_q57; /* 0 ... RATE_MOST */
    int64_t slope_q56;
};

/* What the rate may do. */
struct rate_bounds {
    int64_t most_q57;   /* RATE_ONE ... RATE_MOST */
    int64_t slope_q56;  /* 1 ... RATE_SLOPE_MOST */
    int64_t second_q56; /* 1 ... RATE_SLOPE_MOST */
};

/* The least of both, for each bound. */
struct rate_bounds rate_bounds_least(const struct rate_bounds *a, const struct rate_bounds *b);

/* Slope at the end of the next tick on the fastest way to the target: the greatest from which the
 * rate can still come to rest there. Changes by at most `second`, stays within `slope` once it is.
 * Where rate_stop does not lie beyond the target, the rate never passes it and, after finitely many
 * ticks, is there with slope 0. */
int64_t rate_next_slope(const struct rate *rate, int64_t target_q57,
                        const struct rate_bounds *bounds);

/* One tick that ends with this slope. */
void rate_move(struct rate *rate, int64_t slope_q56);

/* What comes of taking the slope to 0 as fast as `second` lets it in whole ticks. */
struct rate_stop {
    int64_t ticks;
    int64_t rest_q57; /* the rate then; far outside 0 ... RATE_MOST where it is beyond +-8 */
};

struct rate_stop rate_stop(const struct rate *rate, int64_t second_q56);

/* Upper bound of the program time, in ticks at rate 1, 2^-12 of one, until rate_next_slope has
 * reached the target; INT64_MAX when that may take more than RATE_SPAN_TICKS. `stop` is rate_stop with the same bounds. */
int64_t rate_span_q12(const struct rate *rate, const struct rate_stop *stop, int64_t target_q57,
                      const struct rate_bounds *bounds);

#endif
