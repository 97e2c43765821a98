/* SPDX-License-Identifier: MIT */
/*
 * path_bounds: bounds of the first three derivatives of each axis by arc length, on a stretch of the path. Used by the
 * proof of the stops (core/brake_check, for `hodograph verify`). Changes only its struct; no I/O.
 *
 * Each segment is divided into 8 to 64 equal parts. A shorter stretch takes smaller parts. Stored for each part are the
 * derivatives at both ends and their greatest difference from the straight line between the ends. This difference
 * follows from a bound of the second derivative (core/path_motion). The parts used last stay stored, because the next
 * stretch is near.
 *
 * Integers only (core/real.h). Main loop. The caller provides the memory, about 2.5 KiB.
 */
#ifndef HODOGRAPH_CORE_PATH_BOUNDS_H
#define HODOGRAPH_CORE_PATH_BOUNDS_H

#include "core/path_motion.h"

#define PATH_BOUNDS_KEPT 32u /* parts of a planar program; fewer with more axes */

struct span {
    struct real low;
    struct real high;
};

/* By axis: derivatives 1 to 3 by arc length, 1, 1/mm and 1/mm^2. */
struct path_stretch {
    struct span of[PROGRAM_AXES][QUANTITIES];
};

/* m 2^e, |m| < 2^15: a number to keep. */
struct path_bounds_number {
    int16_t m;
    int16_t e;
};

/* Contents private. */
struct path_bounds {
    const struct program *program;
    struct path path;                   /* segment number `segment`, */
    uint32_t segment;                   /* the one read last; UINT32_MAX: none */
    uint32_t size;                      /* numbers of a part, */
    uint32_t kept;                      /* and how many parts can be stored */
    uint32_t part_of[PATH_BOUNDS_KEPT]; /* which part is stored there; 0: none */
    struct path_bounds_number numbers[PATH_BOUNDS_KEPT * 3u * PROGRAM_PLANE * QUANTITIES];
};

/* For a program whose segments have passed their checks. */
void path_bounds_begin(struct path_bounds *bounds, const struct program *p);

/* Bounds on the stretch from one arc length to another; arc lengths beyond the ends of the path count as its ends.
 * `segment`: the segment of the first, or one before it. Sets the program's axes only. */
void path_bounds_of(struct path_bounds *bounds, uint32_t segment, int64_t from_q40_mm,
                    int64_t to_q40_mm, struct path_stretch *out);

#endif
