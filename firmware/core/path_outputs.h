/* SPDX-License-Identifier: MIT */
/*
 * Outputs on the path: which outputs are on, and the values of the analogue ones, at each setpoint of a program.
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
    const struct program *program; /* NULL: no event is left that could act */
    int64_t next_place_q40_mm;     /* of event `next` */
    uint32_t next;
    uint32_t proportional;               /* bit i: analogue value i follows the feed, */
    int32_t gain_q16[PROGRAM_ANALOGUES]; /* by so much for each mm/s */
    struct path_outputs_values values;
};

/* All outputs off, and no events. */
void path_outputs_clear(struct path_outputs *outputs);

/* From all outputs off: what all events at or before an arc length make of them; a negative one: of a program whose
 * first setpoint is to come. Main loop; linear in the number of events. */
void path_outputs_begin(struct path_outputs *outputs, const struct program *program,
                        int64_t arc_length_q40_mm);

/* Takeover of the next chunk in motion: the outputs stay, and the next event stays the same one. `program` begins at
 * arc length arc_shift_q40_mm of `before` and has the events of `before` from there on (core/chunk.h). Some 32 steps at
 * most. */
void path_outputs_carry(struct path_outputs *outputs, const struct program *before,
                        const struct program *program, int64_t arc_shift_q40_mm);

/* Takeover at rest, of a program whose first setpoint is still to come: the outputs stay, and all its events are to
 * come. Constant time. */
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
