/* SPDX-License-Identifier: MIT */
/* path_counts: converts the point of a program from mm to counts of the machine's axes. Used by app/machine/motion,
 * app/program_slot and app/stream. Pure; tick or main loop. */
#ifndef APP_MACHINE_PATH_COUNTS_H
#define APP_MACHINE_PATH_COUNTS_H

#include <stdint.h>

#include "app/machine/config.h"
#include "core/counts.h"
#include "core/interpolator.h"

struct path_counts {
    uint32_t first_axis;             /* of the machine that the program moves (core/first_axis.h) */
    uint32_t axis_count;             /* of the program: 2 ... AXES_MAX */
    uint32_t per_unit[PROGRAM_AXES]; /* by axis of the program: counts of a mm, or of a degree */
};

void path_counts_init(struct path_counts *scale, const struct program *program,
                      const struct config *config);

/* First and last setpoint of a program with the configured kernel, by axis of the machine; unchanged if this image does
 * not have the kernel. Main loop. */
void path_counts_ends(const struct program *program, const struct config *config,
                      int32_t start_counts[AXES_MAX], int32_t end_counts[AXES_MAX]);

/* The axes after y, for the next function. */
void path_counts_others(const struct path_counts *scale, const struct interpolator_point *point,
                        int32_t counts[AXES_MAX]);

/* Counts of the axes that the program moves, by axis of the machine; the others are left as they are. */
static inline void path_counts_of(const struct path_counts *scale,
                                  const struct interpolator_point *point, int32_t counts[AXES_MAX])
{
    int32_t *own = counts + scale->first_axis;
    own[0] = counts_from_q40_mm(point->position_q40[0], scale->per_unit[0]);
    own[1] = counts_from_q40_mm(point->position_q40[1], scale->per_unit[1]);
    if (scale->axis_count > PROGRAM_PLANE) {
        path_counts_others(scale, point, counts);
    }
}

#endif
