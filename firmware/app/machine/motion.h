/* SPDX-License-Identifier: MIT */
/*
 * motion: one run of a program. In each tick it computes the point on the path, from the program and the commands
 * (hold, stop, override), and the targets of the axes that follow the path.
 *
 * Used by firmware/app. Main loop: app/commands.c and app/stream.c prepare it and hand it to the machine. Then it
 * belongs to the tick (machine_tick.c), under the port's lock. The functions change only the motion; no I/O.
 */
#ifndef APP_MACHINE_MOTION_H
#define APP_MACHINE_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/config.h"
#include "app/machine/path_counts.h"
#include "core/chunk.h"
#include "core/feed_override.h"
#include "core/interpolator.h"
#include "core/path_outputs.h"

struct motion {
    struct interpolator interp;
    struct feed_override feed;
    struct interpolator_point point; /* of the last setpoint */
    uint32_t setpoints;              /* number of setpoints up to now */
    uint32_t rested_ticks;           /* at the end of the program, running, until the next chunk */
    uint32_t rest_ticks;             /* before the program starts */
    bool joined;   /* the end of the program is a rest of the job, not the end of a tail */
    bool precedes; /* `point` is the end of the previous chunk: a rest is under way */
    struct path_counts scale;
    /* at the last setpoint; stepped by `outputs`, where there is an I/O module */
    struct path_outputs outputs;
};

/* Sets up the first setpoint. The program must have passed program_check; it must stay while the
 * motion lasts. 0 or a negative INTERPOLATOR_ERR_... Main loop; linear in the number of pieces. */
int motion_begin(struct motion *motion, const struct program *program, const struct config *config);

/* The same for a start from standstill at an arc length of the program. Gives its position in counts. Main loop. */
int motion_begin_at(struct motion *motion, const struct program *program,
                    const struct config *config, int64_t arc_length_q40_mm,
                    int32_t start_counts[AXES_MAX]);

/* As motion_begin, for the first chunk of a job, with these records from its start on. Main loop. */
void motion_begin_job(struct motion *motion, const struct chunk *first,
                      const struct coefficients_window *window, const struct config *config);

/* Takes the next chunk of the job over, with its coefficient records in `window`. This is possible while the motion is
 * in the part that both chunks share, or rests: then true, and the previous chunk is free. A chunk that
 * begins at rest starts chunk_rest_ticks after the end of its predecessor, or at once if it comes later. Ticks of a
 * hold do not count. Under the lock. */
bool motion_take_over(struct motion *motion, const struct chunk *next,
                      const struct coefficients_window *window);

/* True when the main loop should compute the next coefficient records of the chunk. Timer. */
static inline bool motion_wants_records(const struct motion *motion)
{
    return feed_override_wants_records(&motion->feed, &motion->interp) != 0;
}

/* The next setpoint: targets of the axes that the program moves, by axis of the machine. 0, or a negative
 * INTERPOLATOR_ERR_... with targets unchanged. Timer. */
int motion_step(struct motion *motion, int32_t target_counts[AXES_MAX]);

/* How many axes the motion moves. Pure. */
static inline uint32_t motion_axis_count(const struct motion *motion)
{
    return motion->scale.axis_count;
}

/* Number of the first axis of the machine that the motion moves. Pure. */
static inline uint32_t motion_first_axis(const struct motion *motion)
{
    return motion->scale.first_axis;
}

/* Number of the axis after the last one that it moves. Pure. */
static inline uint32_t motion_axes_end(const struct motion *motion)
{
    return motion_first_axis(motion) + motion_axis_count(motion);
}

/* Counts the ticks of a rest between two chunks; call it before motion_step in each tick. True: this tick repeats the
 * last setpoint, and motion_step must not be called. Timer. */
bool motion_rests(struct motion *motion);

/* Commands a path stop: motion_stop inside the limits of the program, motion_fault_stop inside those of the machine.
 * Under the lock. */
void motion_stop(struct motion *motion);
void motion_fault_stop(struct motion *motion);

/* Feed hold, its end, the commanded override (0 ... 200 %). Under the lock. */
void motion_hold(struct motion *motion);
void motion_resume(struct motion *motion);
void motion_override(struct motion *motion, uint32_t percent);

/* True while a hold has the path at rest. */
bool motion_held(const struct motion *motion);

/* True at rest at the end of the tail of a chunk: the motion needs the next chunk to continue. */
bool motion_waits(const struct motion *motion);

/* The same, except at a rest of the job (before a chunk that begins at rest). */
bool motion_misses_chunk(const struct motion *motion);

/* True while the motion comes to rest and has passed its stop deadline (1.2 times the stop time bound). */
bool motion_late(const struct motion *motion);

/* True at the end of the program or of a stop: all further setpoints are equal. */
bool motion_over(const struct motion *motion);

/* Program time of the last setpoint, to nearest; before the first one that of the start; in a path stop that of its
 * start. Under the lock. */
uint64_t motion_time_q32_s(const struct motion *motion);

/* Feed along the path at the last setpoint, in um/s, held at 2^31 - 1 (2147 m/s). Under the lock. */
int32_t motion_feed_um_s(const struct motion *motion);

#endif
