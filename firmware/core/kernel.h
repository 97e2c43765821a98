/* SPDX-License-Identifier: MIT */
/*
 * kernel: the interface of a kernel, which precomputes the coefficients of segments and feed pieces, and evaluates
 * them. Used by firmware, sim/offline/stream and host tools: core/coefficients precomputes (main loop),
 * core/interpolator evaluates (tick), the others select or list kernels.
 *
 * `kernels_linked` lists the kernels of an image: core/kernels_all.c on a host, one of firmware/targets/kernels_*.c on
 * a microcontroller. Pure, any context.
 */
#ifndef HODOGRAPH_CORE_KERNEL_H
#define HODOGRAPH_CORE_KERNEL_H

#include <stddef.h>
#include <stdint.h>

#include "core/feed_piece.h"
#include "core/ph_segment.h"
#include "core/program.h"

/* Numbers as in object 0x2004 sub 5. The errors are bounds of x, y and z before they are rounded to counts, on segments
 * longer than 2^-34 mm (docs/theory/numerics.md sections 9 to 11). That of KERNEL_FIXED uses the largest error of the
 * first guess that a search found; the bound that needs no search is 2^-31 mm. */
enum kernel_number {
    KERNEL_FIXED = 0,  /* integers only, the same bits everywhere, within 2^-37 mm */
    KERNEL_FLOAT = 1,  /* single precision and integers, within 1 nm */
    KERNEL_DOUBLE = 2, /* the host's reference, within 3e-11 mm */
};

#define KERNELS 3u /* of enum kernel_number */

/* KERNEL_INLINE: for code that the planar and the spatial version of a kernel share. It is inlined into both, so a tick
 * has no additional call. KERNEL_APART: for code of one version only, which stays a function. */
#if defined(__GNUC__)
#define KERNEL_INLINE static inline __attribute__((always_inline))
#define KERNEL_APART  __attribute__((noinline))
#else
#define KERNEL_INLINE static inline
#define KERNEL_APART
#endif

/* Precomputed coefficients are private to the kernel: `*_size` bytes, aligned to 8. Result parameters come before
 * 64-bit arguments, so that a 32-bit Arm passes all of them in registers. */

/* How a kernel evaluates the path of a program. */
struct kernel_path {
    size_t segment_size; /* bytes for up to three path axes, */
    size_t extra_size;   /* and for each extra axis */
    void (*segment_set)(void *segment, const struct ph_segment *from);
    /* The point at an arc length of this segment (from the start of the program): a coordinate for each path axis. */
    void (*segment_at)(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);
};

struct kernel {
    size_t piece_size;
    void (*piece_set)(void *piece, const struct program_piece *from);
    /* Arc length and feed at local time t, 0 <= t < duration. */
    void (*piece_at)(const void *piece, struct feed_point *out, uint64_t t_q42_s);
    /* Path acceleration F'' at local time t, in 2^-40 mm/s^2. */
    int64_t (*piece_acceleration)(const void *piece, uint64_t t_q42_s);
    struct kernel_path plane; /* for planar programs */
    struct kernel_path space; /* for spatial programs */
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
