/* SPDX-License-Identifier: MIT */
/*
 * qwide: exact sums of products of 50-bit numbers, for decisions that must not depend on rounding: the speed ratio and
 * the direction at joints. A value is high 2^50 + low. Used by core/segment_check and core/joint_check. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_QWIDE_H
#define HODOGRAPH_CORE_QWIDE_H

#include <stdint.h>

/* Normal form: 0 <= low < 2^50. |high| stays below 2^62 for any sum used here (at most 2^10
 * products). */
struct qwide {
    int64_t high;
    int64_t low;
};

/* sum + weight a b, in normal form; |a|, |b| < 2^50, |weight| <= 16. */
struct qwide qwide_add_product(struct qwide sum, int64_t a, int64_t b, int64_t weight);

struct qwide qwide_add(struct qwide a, struct qwide b);
struct qwide qwide_abs(struct qwide a);

/* floor(a / 2^bits), 0 <= bits <= 49. */
struct qwide qwide_shift_down(struct qwide a, int bits);

/* -1, 0 or 1 as a is below, equal to or above b; both in normal form. */
int qwide_compare(struct qwide a, struct qwide b);

#endif
