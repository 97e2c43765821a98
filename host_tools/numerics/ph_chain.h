/* SPDX-License-Identifier: MIT */
/*
 * ph_chain: chains of Pythagorean-hodograph quintic segments: places by arc length, and derivatives by arc length
 * there. The feed planner needs them at very many places. docs/theory/numerics.md 4.3 and 5.6,
 * docs/theory/spatial-splines.md 2. Called by host_tools/hodograph/native.
 *
 * Double arithmetic without contraction: the same bits on every computer. No heap. The functions write the caller's
 * arrays only; any thread.
 */
#ifndef HODOGRAPH_NUMERICS_PH_CHAIN_H
#define HODOGRAPH_NUMERICS_PH_CHAIN_H

#include <stdint.h>

/* N segments with xi in [0, 1]; Bernstein coefficients. In the plane r' = w^2, two axes follow; in space r' = A i A*,
 * and 3 + E axes. */
struct ph_chain {
    uint32_t segments, planar; /* N, at least 1; planar: 1 in the plane, 0 in space */
    uint32_t extra;            /* E; 0 in the plane */
    const double *start;       /* [N + 1], arc length at the joints, mm; never decreasing */
    const double *arc;         /* [N][6], arc length from the start of each segment, mm */
    const double *speed;       /* [N][5], its derivative by xi */
    /* in the plane [N][3][2], real and imaginary part of w; in space [N][4][3], of A */
    const double *preimage;
    const double *extra_axes; /* [N][E][6]; mm, degrees */
};

/* Segment and xi at arc lengths in 0 to start[N], to `tolerance` of the segment's arc length. At a joint those of the
 * segment that begins there. About 0.1 us each where the arc lengths ascend. */
void ph_locate(const struct ph_chain *chain, uint32_t count, const double *arc_mm, double tolerance,
               int64_t *segment, double *xi);

/* r_s, r_ss and r_sss, [axes][count], and the curvature [count] of segments at xi: in the plane signed, positive to the
 * left, in space a magnitude. The parametric speed has to be above 0 there. 0.1 us each. */
void ph_frames(const struct ph_chain *chain, uint32_t count, const int64_t *segment,
               const double *xi, double *r1, double *r2, double *r3, double *curvature);

#endif
