/* SPDX-License-Identifier: MIT */
/* Implements app/machine/path_counts.h (see there): the point of a program in counts of its path axes. Used by
 * app/machine/motion, app/program_slot and app/stream. Pure; tick or main loop. */
#include "app/machine/path_counts.h"

#include <stddef.h>

#include "core/first_axis.h"
#include "core/kernel.h"

void path_counts_init(struct path_counts *scale, const struct program *program,
                      const struct config *config)
{
    scale->first_axis = first_axis(&program->header);
    scale->axis_count = program->header.axis_count;
    for (uint32_t i = 0; i < PROGRAM_AXES; ++i) {
        const uint32_t axis = scale->first_axis + i;
        scale->per_unit[i] = axis < AXES_MAX ? config_counts_per_unit(config, axis) : 0u;
    }
}

void path_counts_ends(const struct program *program, const struct config *config,
                      int32_t start_counts[AXES_MAX], int32_t end_counts[AXES_MAX])
{
    const struct kernel *kernel = kernel_find(config->kernel);
    struct interpolator_point first;
    struct interpolator_point last;
    struct path_counts scale;
    if (kernel == NULL) {
        return;
    }
    interpolator_ends(program, kernel, &first, &last);
    path_counts_init(&scale, program, config);
    path_counts_of(&scale, &first, start_counts);
    path_counts_of(&scale, &last, end_counts);
}

void path_counts_others(const struct path_counts *scale, const struct interpolator_point *point,
                        int32_t counts[AXES_MAX])
{
    int32_t *own = counts + scale->first_axis;
    for (uint32_t i = PROGRAM_PLANE; i < scale->axis_count; ++i) {
        own[i] = counts_from_q40_mm(point->position_q40[i], scale->per_unit[i]);
    }
}
