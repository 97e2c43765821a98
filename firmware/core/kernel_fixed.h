/* SPDX-License-Identifier: MIT */
/*
 * kernel_fixed: the fixed kernel, integers only, for targets without an FPU; the same bits everywhere. Derivation,
 * ranges and the error bound: docs/theory/numerics.md sections 9 and 12. Feed pieces are evaluated by
 * core/feed_piece.h. Used by core/coefficients; called through struct kernel (core/kernel.h). Pure; the functions named
 * *_set in the main loop, the others in the tick.
 *
 * "Normalised" is divided by 2^exponent of the segment, so that sigma lies in [1/8, 1). Polynomials
 * in z keep their coefficient k times 2^k, because a product of the upper halves with z in q31 is
 * half the product: no shift in the Horner step.
 */
#ifndef HODOGRAPH_CORE_KERNEL_FIXED_H
#define HODOGRAPH_CORE_KERNEL_FIXED_H

#include "core/extra_axis.h"
#include "core/ph_segment.h"

/* First guess of z in one half of a segment: a cubic in t, the arc length from the middle divided by that of the half.
 */
struct kernel_fixed_inverse {
    int32_t scale_q26;
    int32_t g_q26[3]; /* coefficient k of t^k times 2^k, k = 1 ... 3 */
};

/* Arc length and its inverse. */
struct kernel_fixed_arc {
    int64_t origin_q40_mm;
    int64_t c_q48_mm[6];
    int32_t s_q30[6];     /* normalised arc length from the middle */
    int32_t slope_q29[5]; /* its derivative in z: sigma / 2 */
    int32_t exponent;
    struct kernel_fixed_inverse inverse[2]; /* before and after the middle */
};

struct kernel_fixed_axis {
    int64_t origin_q40_mm;
    int64_t c_q48_mm[6];
};

/* Of a planar program. */
struct kernel_fixed_segment {
    struct kernel_fixed_arc arc;
    struct kernel_fixed_axis axes[PROGRAM_PLANE];
    int32_t u_q28[3]; /* normalised w */
    int32_t v_q28[3];
};

/* Of a spatial program; a record ends with the last extra axis that the program has. */
struct kernel_fixed_space {
    struct kernel_fixed_arc arc;
    struct kernel_fixed_axis axes[PROGRAM_SPACE];
    int32_t a_q28[PROGRAM_COMPONENTS][3]; /* normalised preimage */
    uint32_t extras;
    uint32_t reserved;
    struct extra_axis extra[PROGRAM_EXTRAS];
};

/* The functions have the types of struct kernel: `segment` is a struct kernel_fixed_segment. */

void kernel_fixed_segment_set(void *segment, const struct ph_segment *ph);

/* Point at an arc length of this segment (counted from the start of the program; 2^-33 mm outside is allowed: the curve
 * is continued by its tangent). Within 2^-37 mm (numerics.md section 9), 2^-31 mm by the bound that needs no search
 * (section 12). Two Newton steps with one 32-bit division each, 15 wide products. */
void kernel_fixed_segment_at(const void *segment, int64_t position_q40[],
                             int64_t arc_length_q40_mm);

/* The same for a struct kernel_fixed_space. */
void kernel_fixed_space_set(void *segment, const struct ph_segment *ph);
void kernel_fixed_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);

#endif
