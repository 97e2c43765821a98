/* SPDX-License-Identifier: MIT */
#include "app/machine/path_counts.h"

void path_counts_init(struct path_counts *scale, const struct program *program,
                      const struct config *config)
{
    scale->axis_count = program->header.axis_count;
    scale->per_mm = config->counts_per_mm;
    for (uint32_t i = PROGRAM_SPACE; i < PROGRAM_AXES; ++i) {
        scale->per_unit[i - PROGRAM_SPACE] = config_counts_per_unit(config, i);
    }
}

void path_counts_rest(const struct path_counts *scale, const struct interpolator_point *point,
                      int32_t counts[AXES_MAX])
{
    counts[PROGRAM_PLANE] = counts_from_q40_mm(point->position_q40[PROGRAM_PLANE], scale->per_mm);
    for (uint32_t i = PROGRAM_SPACE; i < scale->axis_count; ++i) {
        counts[i] = counts_from_q40_mm(point->position_q40[i], scale->per_unit[i - PROGRAM_SPACE]);
    }
}
