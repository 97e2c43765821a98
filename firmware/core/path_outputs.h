/* SPDX-License-Identifier: MIT */
/*
 * path_outputs: which outputs of the path are on, and the values of the analogue ones, at each setpoint of a program.
 * Used by app/machine, sim/offline and host tools. Main loop or tick, as each function states. Changes only its struct;
 * no I/O.
 *
 * An event (docs/reference/protocol.md 1.8) acts in the tick whose setpoint is the first at or past its place. So the
 * outputs depend on the program and the place alone, not on override, holds or the place of the start. A value in
 * proportion to the feed follows the feed along the path at each setpoint; at rest it is 0.
 *
 * No heap, no globals. The image must outlive the struct, and must have passed program_check.
 */
#ifndef HODOGRAPH_CORE_PATH_OUTPUTS_H
#define HODOGRAPH_CORE_PATH_OUTPUTS_H

#include <stddef.h>
#include <stdint.h>

#include "core/program.h"

/* Levels of the digital outputs (bit i: output i), values of the analogue ones. */
struct path_outputs_values {
    uint16_t digital;
    int16_t analogue[PROGRAM_ANALOGUES];
};

/* Fields but `values` are private. */
struct path_outputs {
    const struct program *program; /* NULL: no event follows that could act */
    int64_t next_place_q40_mm;     /* of event `next` */
    uint32_t next;
    uint32_t proportional;               /* bit i: analogue value i follows the feed, */
    int32_t gain_q16[PROGRAM_ANALOGUES]; /* by so much for each mm/s */
    struct path_outputs_values values;
};

/* All outputs off, and no events. Any context. */
void path_outputs_clear(struct path_outputs *outputs);

/* These outputs, and no events. Main loop with the tick held off. */
void path_outputs_set(struct path_outputs *outputs, const struct path_outputs_values *values);

/* Outputs at an arc length: all off, then switched by the events at or before it. A negative arc length is that of a
 * program before its first setpoint. Main loop; linear in the number of events. */
void path_outputs_begin(struct path_outputs *outputs, const struct program *program,
                        int64_t arc_length_q40_mm);

/* Takeover of the next chunk in motion: the outputs stay, and the next event stays the same one. `program` begins at
 * arc length arc_shift_q40_mm of `before` and has the events of `before` from there on (core/chunk.h). At most some 32
 * steps. Main loop with the tick held off. */
void path_outputs_carry(struct path_outputs *outputs, const struct program *before,
                        const struct program *program, int64_t arc_shift_q40_mm);

/* Takeover at rest, before the first setpoint of `program`: the outputs stay, and all its events follow. Main loop with
 * the tick held off; constant time. */
void path_outputs_begin_next(struct path_outputs *outputs, const struct program *program);

/* The outputs at a setpoint, at this arc length and with this feed along the path. Tick context; at most
 * PROGRAM_EVENTS_A_TICK events act. */
void path_outputs_step(struct path_outputs *outputs, int64_t arc_length_q40_mm,
                       int64_t feed_q32_mm_s);

/* 1: path_outputs_step has something to do. */
static inline int path_outputs_active(const struct path_outputs *outputs)
{
    return outputs->program != NULL || outputs->proportional != 0u;
}

#endif
