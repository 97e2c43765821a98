/* SPDX-License-Identifier: MIT */
/*
 * ph_segment: expands a PH segment for evaluation: the one exact-integer step that all kernels start from.
 *
 * The image holds the preimage in Bernstein form. Products of its coefficients are formed exactly (25-bit
 * limbs) and give x, y, z and the arc length s as polynomials in z = 2 xi - 1, z from -1 to 1:
 * centred, so that the rounding of a Horner step never grows. docs/theory/numerics.md section 9,
 * "Expansion".
 *
 * Used by firmware/core: the kernels, their coefficient records, and the checks of segments and axis limits. Pure;
 * about 10^3 instructions on a 32-bit target. Main loop or tick.
 */
#ifndef HODOGRAPH_CORE_PH_SEGMENT_H
#define HODOGRAPH_CORE_PH_SEGMENT_H

#include <stdint.h>

#include "core/program.h"

enum ph_axis { PH_S = 0, PH_X = 1, PH_Y = 2, PH_Z = 3 };
#define PH_AXES 4

/* The last one of a segment of a program with so many path axes. */
static inline int ph_last_axis(uint32_t axis_count)
{
    return axis_count > PROGRAM_PLANE ? PH_Z : PH_Y;
}

/* A segment with sigma below 2^PH_LEAST_EXPONENT mm, so shorter than 2^-34 mm, is far below the
 * resolution: its arc length is replaced by a straight one and the preimage by 0, and every value is still
 * within 2^-34 mm. */
#define PH_LEAST_EXPONENT (-34)

/* By how much, relative, 2^exponent is above sigma: |A| in 2^(exponent/2) stays below 1 - 2^-25, so that it is below 1
 * in the kernels' words after any rounding. */
#define PH_MARGIN_BITS 24

/* An extra axis in powers of z, exact; the first coefficient contains its start. */
struct ph_extra {
    int64_t c_q45[6];
};

/* Needs a segment that keeps the rules of protocol.md 1.2. */
struct ph_segment {
    int64_t origin_q40_mm[PH_AXES]; /* s, x, y and z at its start, as in the image */
    /* Powers of z, relative to the origin, by enum ph_axis: value = sum of c[k] z^k. Each coefficient is within 2^-47
     * mm of the exact one. */
    int64_t c_q48_mm[PH_AXES][6];
    int64_t sigma_q50_mm[3]; /* parametric speed ds/dxi at xi = 0, 1/2, 1; within 2^-47 */
    /* The preimage in powers of z, times 4: (4 A = a[0] + a[1] z + a[2] z^2), exact; by enum program_component. */
    int64_t a_q44[PROGRAM_COMPONENTS][3];
    /* even; 2^exponent is above every Bernstein coefficient of sigma (by PH_MARGIN_BITS), 2^(exponent-2) is not */
    int exponent;
    uint32_t axis_count; /* of the program: of a planar one nothing of z, v and p is set */
    struct ph_extra extra[PROGRAM_EXTRAS]; /* the first axis_count - 3 are set */
};

/* Bernstein coefficients of sigma, dx/dxi, dy/dxi and dz/dxi (by enum ph_axis), the middle one times 3;
 * each within 2^-46 of the exact value. */
void ph_segment_hodograph(const struct program_segment *segment, int64_t e_q50[5][PH_AXES]);

void ph_segment_expand(struct ph_segment *ph, const struct program_segment *segment);

/* s, x, y, z at the end of the segment (xi = 1), relative to the origin; within 2^-45 mm. */
void ph_segment_end(const struct ph_segment *ph, int64_t end_q48_mm[PH_AXES]);

#endif
