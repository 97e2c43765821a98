/* SPDX-License-Identifier: MIT */
/* Implements core/bernstein.h (see there): bounds of a polynomial from its Bernstein coefficients. Used by
 * core/feed_bounds. Integer arithmetic; pure, main loop. */
#include "core/bernstein.h"

#include <string.h>

#define COEFFICIENTS (BERNSTEIN_MOST_DEGREE + 1)
#define MOST_DEPTH   9 /* halvings until a polynomial counts as outside */

/* scale / C(n,k) for n = 4, 5, 6, 7 */
static const int64_t scaled_inverse[4][COEFFICIENTS] = {
    {12, 3, 2, 3, 12, 0, 0, 0},
    {10, 2, 1, 1, 2, 10, 0, 0},
    {60, 10, 4, 3, 4, 10, 60, 0},
    {105, 15, 5, 3, 3, 5, 15, 105},
};

int64_t bernstein_from_powers(const int64_t *a, int degree, int64_t *b)
{
    if (degree < 4 || degree > BERNSTEIN_MOST_DEGREE) {
        return 0;
    }
    const int64_t *factor = scaled_inverse[degree - 4];
    for (int k = 0; k <= degree; k++) {
        b[k] = factor[k] * a[k];
    }
    /* the binomials C(j,k) by the Pascal triangle, in place */
    for (int step = 1; step <= degree; step++) {
        for (int j = degree; j >= step; j--) {
            b[j] += b[j - 1];
        }
    }
    return factor[0];
}

static int64_t half_sum(int64_t a, int64_t b)
{
    return (a >> 1) + (b >> 1) + (a & b & 1);
}

void bernstein_halve(int64_t *b, int64_t *right, int degree)
{
    for (int step = 0; step <= degree; step++) {
        right[degree - step] = b[degree];
        for (int j = degree; j > step; j--) {
            b[j] = half_sum(b[j - 1], b[j]);
        }
    }
}

static int all_within(const int64_t *b, int degree, int64_t low, int64_t high)
{
    for (int j = 0; j <= degree; j++) {
        if (b[j] < low || b[j] > high) {
            return 0;
        }
    }
    return 1;
}

int bernstein_within(const int64_t *b, int degree, int64_t low, int64_t high)
{
    int64_t stack[MOST_DEPTH + 1][COEFFICIENTS];
    int depth[MOST_DEPTH + 1];
    int top = 0;
    memcpy(stack[0], b, (size_t)(degree + 1) * sizeof b[0]);
    depth[0] = 0;
    while (top >= 0) {
        int64_t *present = stack[top];
        if (all_within(present, degree, low, high)) {
            top--;
            continue;
        }
        /* end coefficients are values of the polynomial */
        if (depth[top] == MOST_DEPTH || present[0] < low || present[0] > high ||
            present[degree] < low || present[degree] > high) {
            return 0;
        }
        bernstein_halve(present, stack[top + 1], degree);
        depth[top]++;
        depth[top + 1] = depth[top];
        top++;
    }
    return 1;
}
