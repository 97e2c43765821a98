/* SPDX-License-Identifier: MIT */
/* Implements app/machine/path_counts.h (see there): the point of a program in counts of its path axes. */
#include "app/machine/path_counts.h"

#include <stddef.h>

#include "core/kernel.h"

void path_counts_init(struct path_counts *scale, const struct program *program,
                      const struct config *config)
{
    scale->axis_count = program->header.axis_count;
    scale->per_mm = config->counts_per_mm;
    for (uint32_t i = PROGRAM_SPACE; i < PROGRAM_AXES; ++i) {
        scale->per_unit[i - PROGRAM_SPACE] = config_counts_per_unit(config, i);
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

void path_counts_rest(const struct path_counts *scale, const struct interpolator_point *point,
                      int32_t counts[AXES_MAX])
{
    counts[PROGRAM_PLANE] = counts_from_q40_mm(point->position_q40[PROGRAM_PLANE], scale->per_mm);
    for (uint32_t i = PROGRAM_SPACE; i < scale->axis_count; ++i) {
        counts[i] = counts_from_q40_mm(point->position_q40[i], scale->per_unit[i - PROGRAM_SPACE]);
    }
}
