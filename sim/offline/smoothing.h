/* SPDX-License-Identifier: MIT */
/*
 * smoothing: moves points of a path sideways, each within its bound, so that the sum of squared third differences
 * becomes least: docs/theory/toolpath-fitting.md section 3. The bounds are kept by a barrier, so every step stays
 * inside them. Called by host_tools/hodograph/native.
 *
 * Newton's method on a banded system, in double arithmetic. No heap: the caller lends all arrays, and no others are
 * written. Any thread.
 */
#ifndef HODOGRAPH_OFFLINE_SMOOTHING_H
#define HODOGRAPH_OFFLINE_SMOOTHING_H

#include <stddef.h>
#include <stdint.h>

/* Points that may be moved. Arrays are of `count` rows, the last index runs fastest. */
struct smoothing {
    uint32_t count;       /* at least 1 */
    uint32_t directions;  /* directions in which each point may move: 1 or 2 */
    const double *point;  /* [3], mm */
    const double *normal; /* [3][directions], these directions, orthonormal */
    const double *bound;  /* greatest shift, mm; 0: the point is fixed */
    /* [4] in count - 3 rows: weighted third difference of point k and the next three */
    const double *coefficient;
};

/* Numbers that `work` has to hold. */
size_t smoothing_work(uint32_t count, uint32_t directions);

/* Shifts (count rows of [directions], mm) of least sum of squares plus `barrier` (above 0) times the barrier of the
 * bounds. At the call `shift` has shifts strictly inside the bounds (0 where a bound is 0). Linear: about 20 us for
 * each hundred points that move in one direction and each halving of the barrier. */
void smoothing_solve(const struct smoothing *s, double barrier, double *shift, double *work);

#endif
