/* SPDX-License-Identifier: MIT */
/*
 * bernstein: bounds of a polynomial from its Bernstein coefficients. On the interval it lies between the least and the
 * greatest coefficient, and each halving of the interval reduces their distance to a quarter (Farouki, "The Bernstein
 * polynomial basis", 2012, section 5). Used by core/feed_bounds. Integer arithmetic; pure, main loop.
 */
#ifndef HODOGRAPH_CORE_BERNSTEIN_H
#define HODOGRAPH_CORE_BERNSTEIN_H

#include <stdint.h>

#define BERNSTEIN_MOST_DEGREE 7

/* Coefficients on [0, 1] from powers: b[j] = scale * sum over k <= j of C(j,k)/C(n,k) a[k], with the scale that makes
 * every factor an integer; returned: 105 for degree 7, 60 for 6, 10 for 5, 12 for 4. Others are not supported (returns
 * 0). */
int64_t bernstein_from_powers(const int64_t *a, int degree, int64_t *b);

/* The same polynomial on the left half of the interval (in place) and on the right one; de Casteljau, rounded down. */
void bernstein_halve(int64_t *b, int64_t *right, int degree);

/* 1 when the polynomial stays in [low, high] on the interval, 0 when it does not, or when nine halvings cannot decide
 * (within about 1e-5 of its variation). |b|, |low|, |high| < 2^62. Explicit stack, at most 1023 intervals. */
int bernstein_within(const int64_t *b, int degree, int64_t low, int64_t high);

#endif
