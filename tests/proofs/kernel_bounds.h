/* SPDX-License-Identifier: MIT */
/*
 * What the fixed kernel's functions promise each other beyond what intervals show: consequences of the positive
 * Bernstein coefficients of sigma (docs/theory/proofs.md section 15.3). Eva takes them for granted in eva_fixed.c, and
 * tests/unit/test_kernel_ranges.c holds the functions themselves to them at the corners. Included by eva_fixed.c and
 * eva_guess.c; never executed, touches nothing.
 */
#ifndef HODOGRAPH_KERNEL_BOUNDS_H
#define HODOGRAPH_KERNEL_BOUNDS_H

/* slope_reciprocal_q15: sigma / 2, normalised, is in [1/16, 1/2]; with room for rounding. */
#define RECIPROCAL_LEAST_Q15 (1 << 15)
#define RECIPROCAL_MOST_Q15  (5 << 17)

/* quadratic: |w| < 1 at any z. */
#define W_BELOW_Q28 (1 << 28)

/* tangent: how far 1 - sigma / sigma is off before a refinement. */
#define ERROR_BELOW_Q25 (1 << 16)

/* newton_step: the arc length from the middle to z is at most half of the greatest sigma, with the sign of z. */
#define HALF_MOST_Q30 ((1 << 29) + (1 << 18))

/* set_inverse: the slope of the cubic at an end, arc length over sigma, is in [1/2, 2]; with room for rounding. */
#define START_LEAST_Q26 (30 << 20)
#define START_MOST_Q26  (132 << 20)

/* first_guess: z has the sign of s; where s is beyond any segment, z is not 0. */
#define FAR_Q30   (1 << 30)
#define FAR_Z_Q31 (1 << 20)

#endif
