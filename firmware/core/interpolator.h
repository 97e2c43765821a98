/* SPDX-License-Identifier: MIT */
/*
 * interpolator: program time in, point on the path out. Used by core, app/machine, sim/offline and host tools. Main
 * loop or tick, as each function states. Changes only its struct; no I/O.
 *
 * The point is a pure function of (program, time, kernel): the cursor inside struct interpolator only stores the
 * present segment and piece. So a run, a seek and a run backwards by seeks give the same bits. Kernels:
 * docs/theory/numerics.md sections 9 (fixed), 10 (float), 11 (double), 12 (the inverse of arc length). The program must
 * have passed program_check with any limits and must have coefficient records (core/coefficients.h); the records decide
 * the kernel. Image and records must outlive the struct.
 */
#ifndef HODOGRAPH_CORE_INTERPOLATOR_H
#define HODOGRAPH_CORE_INTERPOLATOR_H

#include <stdint.h>

#include "core/coefficients.h"
#include "core/feed_piece.h"
#include "core/kernel.h"
#include "core/program.h"

enum interpolator_result {
    INTERPOLATOR_OK = 0,
    INTERPOLATOR_END = 1, /* time is at or beyond the end: the point is the exact end point */
    INTERPOLATOR_ERR_COEFFICIENTS = -1, /* the program has no coefficient records */
    INTERPOLATOR_ERR_PROGRAM = -2,      /* no program */
    /* time is before the cursor, or more than two ends ahead: seek first; or a record is missing */
    INTERPOLATOR_ERR_JUMP = -3,
};

/* Segment ends that a tick may cross by arc length. */
#define INTERPOLATOR_MOST_SEGMENTS 8u

/* Unrounded output of a tick, the same units for all kernels. */
struct interpolator_point {
    int64_t arc_length_q40_mm;
    int64_t feed_q32_mm_s; /* F' at override 100 % */
    /* machine coordinates of the program's path axes, in mm, of a rotary axis in degrees; the others are not written */
    int64_t position_q40[PROGRAM_AXES];
};

/* The positions of the axes after y, for the next function. Tick context. */
void interpolator_point_copy_others(struct interpolator_point *out,
                                    const struct interpolator_point *from, uint32_t axis_count);

/* Copies a point of a program with so many path axes. Tick context. */
static inline void interpolator_point_copy(struct interpolator_point *out,
                                           const struct interpolator_point *from,
                                           uint32_t axis_count)
{
    out->arc_length_q40_mm = from->arc_length_q40_mm;
    out->feed_q32_mm_s = from->feed_q32_mm_s;
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        out->position_q40[axis] = from->position_q40[axis];
    }
    if (axis_count > PROGRAM_PLANE) {
        interpolator_point_copy_others(out, from, axis_count);
    }
}

/* Caller allocates (about 0.2 KiB); contents private. */
struct interpolator {
    const struct program *program;
    const struct kernel *kernel;
    /* of the kernel, for the program's axes */
    void (*segment_at)(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm);
    uint32_t axis_count;
    const struct coefficients_piece *piece; /* the present ones */
    const struct coefficients_segment *segment;
    uint64_t duration_q42_s;
    int64_t length_q40_mm;
    struct interpolator_point end;     /* the exact end point */
    struct coefficients_window window; /* the present records */
};

/* Starts at time 0. Returns 0 or INTERPOLATOR_ERR_... Main loop. */
int interpolator_begin(struct interpolator *it, const struct program *p);

/* The same for a program with these records, among them those of its first piece and segment. Main loop. */
void interpolator_begin_window(struct interpolator *it, const struct program *p,
                               const struct coefficients_window *window);

/* Changes to these records of the same program. The record of the present segment must be among them. Main loop with the
 * tick held off; constant time. */
void interpolator_use(struct interpolator *it, const struct coefficients_window *window);

/* First and last point of a program, with coefficient records or without. Main loop. */
void interpolator_ends(const struct program *p, const struct kernel *kernel,
                       struct interpolator_point *first, struct interpolator_point *last);

/* The record of the segment with this arc length, at most INTERPOLATOR_MOST_SEGMENTS from segment `number` (0 for a
 * number below 0). NULL: the window does not have both, and all between. Main loop; bounded time. */
const struct coefficients_segment *interpolator_segment_in(const struct coefficients_window *window,
                                                           int64_t number,
                                                           int64_t arc_length_q40_mm);

/* Changes to this segment of another program, which is for the same kernel and axes, and has these records and this
 * exact end point. Main loop with the tick held off; constant time. */
void interpolator_carry(struct interpolator *it, const struct program *p,
                        const struct coefficients_window *window,
                        const struct coefficients_segment *segment,
                        const struct interpolator_point *end);

/* Only the last point. Main loop. */
void interpolator_exact_end(const struct program *p, struct interpolator_point *end);

/* The point at a program time in 2^-42 s, below 2^22 s. Crosses at most two piece ends forwards and
 * two segment ends in either direction. program_check guarantees that this suffices for steps up to two
 * periods; otherwise INTERPOLATOR_ERR_JUMP: *out is unchanged, seek before the next call. At or beyond the
 * duration *out is the exact end point and the cursor stays. Returns INTERPOLATOR_OK, INTERPOLATOR_END or
 * INTERPOLATOR_ERR_JUMP. Tick context; bounded time. */
int interpolator_at_q42(struct interpolator *it, uint64_t time_q42_s,
                        struct interpolator_point *out);

/* The same for a caller that has already found the record of the piece that this time lies in. Only the segment is
 * searched; the cursor of pieces stays. INTERPOLATOR_ERR_JUMP also if the piece ends before this time and is not the
 * last; it must not begin after this time. Tick context; bounded time. */
int interpolator_at_piece(struct interpolator *it, const struct coefficients_piece *piece,
                          uint64_t time_q42_s, struct interpolator_point *out);

/* The point at an arc length, for a caller without a program time (core/feed_override); held inside the path. Of *out
 * feed_q32_mm_s is 0. Crosses at most INTERPOLATOR_MOST_SEGMENTS segment ends, else INTERPOLATOR_ERR_JUMP.
 * Tick context; bounded time. */
int interpolator_at_arc_length(struct interpolator *it, int64_t arc_length_q40_mm,
                               struct interpolator_point *out);

/* F'' in 2^-40 mm/s^2 at a time of this piece. Tick context. */
int64_t interpolator_acceleration_q40(const struct interpolator *it,
                                      const struct coefficients_piece *piece, uint64_t time_q42_s);

/* The program time of an arc length, found step by step: the least time at which F has reached it. */
struct interpolator_search {
    int64_t arc_length_q40_mm;
    uint64_t time_q42_s;                    /* the result */
    const struct coefficients_piece *piece; /* that it lies in, once found */
    uint32_t piece_index;
    uint32_t bisecting; /* the piece is found; the time is between these two, from its start: */
    uint64_t low_q42_s;
    uint64_t high_q42_s;
};

/* Searches from piece `index` on, which begins at or before the arc length. Tick context. */
void interpolator_search_begin(struct interpolator_search *search, uint32_t index,
                               int64_t arc_length_q40_mm);

/* One step: advances by one piece of the image, or halves the time interval. 1 when the time is found, else 0. Some 60
 * steps, and one for each piece before the right one. If the record of the piece is missing, the search waits for it.
 * Tick context; bounded time. */
int interpolator_search_step(const struct interpolator *it, struct interpolator_search *search);

/* As interpolator_at_q42, at a time in 2^-32 s, for tools. A tick uses the finer one: at 100 mm/s, 2^-33 s of rounding
 * is 1e-8 mm, some 50 mm/s^3 in the third difference at 1 kHz. */
int interpolator_at(struct interpolator *it, uint64_t time_q32_s, struct interpolator_point *out);

/* Moves the cursor to any time, forward or back; linear in the number of segments and pieces. Returns 0. Main loop. */
int interpolator_seek(struct interpolator *it, uint64_t time_q32_s);

#endif
