/* SPDX-License-Identifier: MIT */
/*
 * The float kernel: single precision where it pays, integers for arc length, origins and the two
 * lowest powers of z. No double, no 64-bit conversion: int32 to float and back only. Derivation and
 * error bound: docs/numerics.md section 10. Feed pieces are core/feed_piece.h. Only + - * / : with
 * -ffp-contract=off the same bits on every target with IEEE single. Pure, tick context.
 */
#ifndef HODOGRAPH_CORE_KERNEL_FLOAT_H
#define HODOGRAPH_CORE_KERNEL_FLOAT_H

#include "core/ph_segment.h"

/* "Normalised" as in core/kernel_fixed.h. */
struct kernel_float_segment {
    int64_t origin_q40_mm[3];
    int64_t c_q48_mm[3][4]; /* powers 0 ... 3 of z, power k times 2^k */
    float high[3][2];       /* powers 4 and 5, normalised */
    float s[6];             /* normalised arc length from the middle */
    float u[3];             /* normalised w */
    float v[3];
    float inverse[2][4]; /* first guess, before and behind the middle: scale, then cubic */
    int exponent;
};

void kernel_float_segment_set(struct kernel_float_segment *k, const struct ph_segment *ph);

/* As kernel_fixed_segment_at; within 10 nm. Two Newton steps, three divisions, 9 wide products. */
void kernel_float_segment_at(const struct kernel_float_segment *k, int64_t arc_length_q40_mm,
                             int64_t point_q40_mm[2]);

#endif
