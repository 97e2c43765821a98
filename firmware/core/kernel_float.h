/* SPDX-License-Identifier: MIT */
/*
 * kernel_float: the float kernel, for processors with single precision in hardware. The inverse of arc length and the
 * tangent are computed in single precision, everything else in 32-bit integers with a scale for each segment. It uses
 * no double, and converts only int32 to float and back. Derivation and error bound: docs/theory/numerics.md section 10.
 * Feed pieces are evaluated by core/feed_piece.h.
 *
 * Only + - * / are used, with -ffp-contract=off: the same bits on every target with IEEE single precision. Used by
 * core/coefficients; called through struct kernel (core/kernel.h). Pure; the functions named *_set in the main loop,
 * the others in the tick.
 */
#ifndef HODOGRAPH_CORE_KERNEL_FLOAT_H
#define HODOGRAPH_CORE_KERNEL_FLOAT_H

#include "core/extra_axis.h"
#include "core/ph_segment.h"

/* parts of a segment, equal in z, each with its own first guess of the inverse */
#define KERNEL_FLOAT_PARTS 4

/* A coordinate: middle + linear z 2^-31 (q48) + (c1 z + ... + c5 z^5) times the segment's scale. */
struct kernel_float_polynomial {
    int32_t linear_q17_mm;
    int32_t c[5]; /* of z ... z^5; the first is the remainder of the linear one */
};

/* z = z0 + t (g1 + t (g2 + t g3)), t = (s - s0) scale from 0 to 1. */
struct kernel_float_inverse {
    float s0; /* normalised arc length from the middle, as in core/kernel_fixed.h */
    float scale;
    float z0;
    float g[3];
};

/* Arc length and its inverse. */
struct kernel_float_arc {
    int64_t middle_q40_mm;        /* arc length at z = 0, rounded down, */
    int32_t middle_remainder_q48; /* the part below that rounding */
    int32_t scale;                /* 2^(48 - q of the polynomials) */
    int32_t shift;                /* right shift from arc length in q48 to normalised q30 */
    struct kernel_float_polynomial p;
    float s[6]; /* normalised arc length from the middle */
    struct kernel_float_inverse inverse[KERNEL_FLOAT_PARTS];
};

struct kernel_float_axis {
    int64_t middle_q48_mm; /* at z = 0 */
    struct kernel_float_polynomial p;
};

/* Of a planar program. */
struct kernel_float_segment {
    struct kernel_float_arc arc;
    struct kernel_float_axis axes[PROGRAM_PLANE];
    float u[3]; /* normalised w */
    float v[3];
};

/* Of a spatial program; a record ends with the last extra axis that the program has. */
struct kernel_float_space {
    struct kernel_float_arc arc;
    struct kernel_float_axis axes[PROGRAM_SPACE];
    float a[PROGRAM_COMPONENTS][3]; /* normalised preimage */
    /* change of z for a unit of arc length, both in q44, where normalised sigma is 1 */
    float dz_q44;
    uint32_t extras;
    struct extra_axis extra[PROGRAM_EXTRAS];
};

/* The functions have the types of struct kernel: `segment` is a struct kernel_float_segment. */

void kernel_float_segment_set(void *segment, const struct ph_segment *ph);

/* As kernel_fixed_segment_at; within 1 nm. One Newton step, two divisions, six wide products and fifteen narrow
 * ones. */
void kernel_float_segment_at(const void *segment, int64_t position_q40[],
                             int64_t arc_length_q40_mm);

/* The same for a struct kernel_float_space. */
void kernel_float_space_set(void *segment, const struct ph_segment *ph);
void kernel_float_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);

#endif
