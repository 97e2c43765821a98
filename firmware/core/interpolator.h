/* SPDX-License-Identifier: MIT */
/*
 * The interpolator: program time in, point on the path out.
 *
 * The point is a pure function of (program, time, kernel): the cursor inside struct interpolator only remembers the
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
    /* time is before the cursor, or more than two ends ahead: seek first; or a record is not there */
    INTERPOLATOR_ERR_JUMP = -3,
};

/* Segment ends that a tick may cross by arc length. */
#define INTERPOLATOR_MOST_SEGMENTS 8u

/* Unrounded output of a tick, the same units for all kernels. */
struct interpolator_point {
    int64_t arc_length_q40_mm;
    int64_t feed_q32_mm_s; /* F' at override 100 % */
    int64_t position_q40
        [PROGRAM_AXES]; /* machine coordinates of the program's path axes; the others are not written. In
                                         * mm, in degrees for an extra axis that turns */
};

/* The positions of the axes after y, for the next function. */
void interpolator_point_copy_others(struct interpolator_point *out,
                                    const struct interpolator_point *from, uint32_t axis_count);

/* Copies a point of a program with so many path axes. */
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
    void (*segment_at)(const void *segment, int64_t position_q40[],
                       int64_t arc_length_q40_mm); /* of the kernel, for
                                                                        the program's axes */
    uint32_t axis_count;
    const struct coefficients_piece *piece; /* the present ones */
    const struct coefficients_segment *segment;
    uint64_t duration_q42_s;
    int64_t length_q40_mm;
    struct interpolator_point end;     /* the exact end point */
    struct coefficients_window window; /* the records that there are */
};

/* Starts at time 0. Returns 0 or INTERPOLATOR_ERR_... Main loop. */
int interpolator_begin(struct interpolator *it, const struct program *p);

/* The same for a program of which these records are there; those of its first piece and segment are. Main loop. */
void interpolator_begin_window(struct interpolator *it, const struct program *p,
                               const struct coefficients_window *window);

/* Goes on with these records of the same program, which have the present segment. Main loop; constant time. */
void interpolator_use(struct interpolator *it, const struct coefficients_window *window);

/* First and last point of a program, with coefficient records or without. Main loop. */
void interpolator_ends(const struct program *p, const struct kernel *kernel,
                       struct interpolator_point *first, struct interpolator_point *last);

/* The record of the segment with this arc length, at most INTERPOLATOR_MOST_SEGMENTS from that of this number (0 for
 * one below 0); NULL: the window does not have both, and those between. Main loop; bounded time. */
const struct coefficients_segment *interpolator_segment_in(const struct coefficients_window *window,
                                                           int64_t number,
                                                           int64_t arc_length_q40_mm);

/* Goes on in another program for the same kernel and axes, which has these records and this exact end point, in this
 * segment of it. Main loop; constant time. */
void interpolator_carry(struct interpolator *it, const struct program *p,
                        const struct coefficients_window *window,
                        const struct coefficients_segment *segment,
                        const struct interpolator_point *end);

/* Only the last point. */
void interpolator_exact_end(const struct program *p, struct interpolator_point *end);

/* The point at a program time in 2^-42 s, below 2^22 s. Crosses at most two piece ends forwards and
 * two segment ends either way, which program_check guarantees to suffice for steps up to two
 * periods; otherwise INTERPOLATOR_ERR_JUMP: *out is unchanged, seek before going on. At or beyond the
 * duration *out is the exact end point and the cursor stays. Returns INTERPOLATOR_OK, INTERPOLATOR_END or
 * INTERPOLATOR_ERR_JUMP. Tick context; bounded time. */
int interpolator_at_q42(struct interpolator *it, uint64_t time_q42_s,
                        struct interpolator_point *out);

/* The same by a caller that has already found the record of the piece that this time lies in. Only the segment is
 * searched; the cursor of pieces stays where it is. INTERPOLATOR_ERR_JUMP too when the piece ends before this time and
 * is not the last; it must not begin after this time. */
int interpolator_at_piece(struct interpolator *it, const struct coefficients_piece *piece,
                          uint64_t time_q42_s, struct interpolator_point *out);

/* The point at an arc length, for a caller without a program time (core/feed_override); held inside the path. Of *out
 * feed_q32_mm_s is 0. Crosses at most INTERPOLATOR_MOST_SEGMENTS segment ends either way, else INTERPOLATOR_ERR_JUMP.
 * Tick context; bounded time. */
int interpolator_at_arc_length(struct interpolator *it, int64_t arc_length_q40_mm,
                               struct interpolator_point *out);

/* F'' in 2^-40 mm/s^2 at a time of this piece. Tick context. */
int64_t interpolator_acceleration_q40(const struct interpolator *it,
                                      const struct coefficients_piece *piece, uint64_t time_q42_s);

/* Where the program is at an arc length, found step by step: the least time at which F has come to it. */
struct interpolator_search {
    int64_t arc_length_q40_mm;
    uint64_t time_q42_s;                    /* when it is found */
    const struct coefficients_piece *piece; /* that it lies in, once it is known */
    uint32_t piece_index;
    uint32_t bisecting; /* the piece is known; the time is between these two, from its start: */
    uint64_t low_q42_s;
    uint64_t high_q42_s;
};

/* Looks from piece `index` on; it begins at or before the arc length. */
void interpolator_search_begin(struct interpolator_search *search, uint32_t index,
                               int64_t arc_length_q40_mm);

/* One step: goes on by a piece of the image, or halves the time. 1 when it is found, else 0. Some 60 steps and one for
 * each piece on the way; it waits where the record of the piece is not there. Tick context; bounded time. */
int interpolator_search_step(const struct interpolator *it, struct interpolator_search *search);

/* The same at a time in 2^-32 s, for tools. A tick uses the finer one: at 100 mm/s, 2^-33 s of
 * rounding is 1e-8 mm, some 50 mm/s^3 in the third difference at 1 kHz. */
int interpolator_at(struct interpolator *it, uint64_t time_q32_s, struct interpolator_point *out);

/* Moves the cursor to any time, forward or back; linear in the number of segments and pieces.
 * Returns 0. Main loop. */
int interpolator_seek(struct interpolator *it, uint64_t time_q32_s);

#endif
