/* SPDX-License-Identifier: MIT */
/*
 * What a kernel is: how a segment and a feed piece are made ready and then evaluated. core/interpolator.h drives one of them.
 *
 * An image links the kernels that it names: its `kernels_linked` is core/kernels_all.c on a host, one of
 * firmware/targets/kernels_*.c on a microcontroller. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_KERNEL_H
#define HODOGRAPH_CORE_KERNEL_H

#include <stddef.h>
#include <stdint.h>

#include "core/feed_piece.h"
#include "core/ph_segment.h"

/* Numbers as in object 0x2004 sub 5. */
enum kernel_number {
    KERNEL_FIXED = 0,  /* integers only, the same bits everywhere, within 1 nm */
    KERNEL_FLOAT = 1,  /* single precision and integers, within 10 nm */
    KERNEL_DOUBLE = 2, /* the host's reference, within 1e-9 mm */
};

#define KERNELS 3u

/* Contents of a piece or segment that was made ready are the kernel's own: `*_size` bytes, aligned to 8. Results stand
 * before 64-bit arguments: so all of them are passed in registers on a 32-bit Arm. */
struct kernel {
    size_t piece_size;
    size_t segment_size;
    void (*piece_set)(void *piece, const struct program_piece *from);
    void (*segment_set)(void *segment, const struct ph_segment *from);
    /* At local time t, 0 <= t < duration. */
    void (*piece_at)(const void *piece, struct feed_point *out, uint64_t t_q42_s);
    /* F'' there, in 2^-40 mm/s^2. */
    int64_t (*piece_acceleration)(const void *piece, uint64_t t_q42_s);
    /* At an arc length of this segment (from the start of the program). */
    void (*segment_at)(const void *segment, int64_t point_q40_mm[2], int64_t arc_length_q40_mm);
};

extern const struct kernel kernel_fixed;
extern const struct kernel kernel_float;
extern const struct kernel kernel_double;

/* The kernels of this image by number; NULL where it has none. */
extern const struct kernel *const kernels_linked[KERNELS];

/* NULL when this image has no kernel of that number. */
const struct kernel *kernel_find(uint32_t number);

#endif
