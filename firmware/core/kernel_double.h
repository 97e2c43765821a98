/* SPDX-License-Identifier: MIT */
/*
 * kernel_double: the double kernel, IEEE double, the host's reference; docs/theory/numerics.md section 11. Only + - * /
 * and conversions, so with -ffp-contract=off its bits are the same on every IEEE host. Used by core/coefficients;
 * called through struct kernel (core/kernel.h). Pure; the functions named *_set in the main loop, the others in the
 * tick.
 */
#ifndef HODOGRAPH_CORE_KERNEL_DOUBLE_H
#define HODOGRAPH_CORE_KERNEL_DOUBLE_H

#include "core/feed_piece.h"
#include "core/ph_segment.h"

struct kernel_double_piece {
    int64_t start_q40_mm;
    double c_mm[7];
    double tau_per_q42; /* 2^(-42-e) */
    double per_s;       /* 2^-e */
};

/* Arc length and its inverse. */
struct kernel_double_arc {
    int64_t origin_q40_mm;
    double c_mm[6];
    double inverse[2][4]; /* first guess of z, before and after the middle: scale, then cubic */
};

struct kernel_double_axis {
    int64_t origin_q40_mm;
    double c_mm[6];
};

/* Of a planar program. */
struct kernel_double_segment {
    struct kernel_double_arc arc;
    struct kernel_double_axis axes[PROGRAM_PLANE];
};

struct kernel_double_extra {
    double c[6]; /* position in powers of z */
};

/* Of a spatial program; a record ends with the last extra axis that the program has. */
struct kernel_double_space {
    struct kernel_double_arc arc;
    struct kernel_double_axis axes[PROGRAM_SPACE];
    uint64_t extras;
    struct kernel_double_extra extra[PROGRAM_EXTRAS];
};

void kernel_double_piece_set(void *piece, const struct program_piece *from);
/* F'' in 2^-40 mm/s^2, held within 2^62. */
int64_t kernel_double_piece_acceleration(const void *piece, uint64_t t_q42_s);
void kernel_double_piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s);

/* The functions have the types of struct kernel: `segment` is a struct kernel_double_segment, `piece` a struct
 * kernel_double_piece. */

void kernel_double_segment_set(void *segment, const struct ph_segment *ph);

/* Point at an arc length of this segment (counted from the start of the program; a little outside is allowed: the curve
 * is continued). Within 3e-11 mm. Three Newton steps, always. */
void kernel_double_segment_at(const void *segment, int64_t position_q40[],
                              int64_t arc_length_q40_mm);

/* The same for a struct kernel_double_space. */
void kernel_double_space_set(void *segment, const struct ph_segment *ph);
void kernel_double_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);

#endif
