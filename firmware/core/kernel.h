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
#include "core/program.h"

/* Numbers as in object 0x2004 sub 5. */
enum kernel_number {
    KERNEL_FIXED = 0,  /* integers only, the same bits everywhere, within 1 nm */
    KERNEL_FLOAT = 1,  /* single precision and integers, within 10 nm */
    KERNEL_DOUBLE = 2, /* the host's reference, within 1e-9 mm */
};

#define KERNELS 3u

/* For the parts of a tick that a kernel has in common for planar and spatial programs: no call is left in either. */
#if defined(__GNUC__)
#define KERNEL_INLINE static inline __attribute__((always_inline))
#define KERNEL_APART                                                                               \
    __attribute__((noinline)) /* and what only some of them contain, a function of its own */
#else
#define KERNEL_INLINE static inline
#define KERNEL_APART
#endif

/* Contents of a piece or segment that was made ready are the kernel's own: `*_size` bytes, aligned to 8. Results stand
 * before 64-bit arguments: so all of them are passed in registers on a 32-bit Arm. */

/* How a kernel evaluates the path of a program. */
struct kernel_path {
    size_t segment_size; /* of three path axes at most; */
    size_t extra_size;   /* and for each extra axis */
    void (*segment_set)(void *segment, const struct ph_segment *from);
    /* At an arc length of this segment (from the start of the program): as many coordinates as the program has path axes. */
    void (*segment_at)(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);
};

struct kernel {
    size_t piece_size;
    void (*piece_set)(void *piece, const struct program_piece *from);
    /* At local time t, 0 <= t < duration. */
    void (*piece_at)(const void *piece, struct feed_point *out, uint64_t t_q42_s);
    /* F'' there, in 2^-40 mm/s^2. */
    int64_t (*piece_acceleration)(const void *piece, uint64_t t_q42_s);
    struct kernel_path plane; /* of a planar program, */
    struct kernel_path space; /* and of a spatial one */
};

static inline const struct kernel_path *kernel_path(const struct kernel *kernel,
                                                    uint32_t axis_count)
{
    return axis_count > PROGRAM_PLANE ? &kernel->space : &kernel->plane;
}

extern const struct kernel kernel_fixed;
extern const struct kernel kernel_float;
extern const struct kernel kernel_double;

/* The kernels of this image by number; NULL where it has none. */
extern const struct kernel *const kernels_linked[KERNELS];

/* NULL when this image has no kernel of that number. */
const struct kernel *kernel_find(uint32_t number);

#endif
