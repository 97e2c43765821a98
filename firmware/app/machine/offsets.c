/* SPDX-License-Identifier: MIT */
/* Implements app/machine/offsets.h: velocity and torque offsets of the setpoints. Called by app/tick after the
 * machine's step, while feedforward is configured. Timer; offsets_init in the main loop. Changes only its struct. */
#include "app/machine/offsets.h"

#include <stddef.h>
#include <string.h>

void offsets_init(struct offsets *offsets)
{
    memset(offsets, 0, sizeof *offsets);
}

static struct feedforward_gains gains_of(const struct config *config, uint32_t axis)
{
    const struct config_axis *own = &config->axis[axis];
    return (struct feedforward_gains){
        .period_us = config->period_us,
        .counts_per_mm = config_counts_per_unit(config, axis),
        .velocity_permille = own->velocity_permille,
        .torque_per_acceleration_q16 = own->torque_per_acceleration_q16,
        .torque_per_velocity_q16 = own->torque_per_velocity_q16,
    };
}

void offsets_step(struct offsets *offsets, const struct config *config, const struct motion *motion,
                  struct feedforward_offset offset[AXES_MAX])
{
    const uint32_t seen = offsets->setpoints;
    memset(offset, 0, AXES_MAX * sizeof offset[0]);
    offsets->setpoints = motion != NULL ? motion->setpoints : 0u;
    if (motion == NULL || motion->setpoints == seen) {
        return;
    }
    const int64_t *position_q40 = motion->point.position_q40;
    const uint32_t first = motion_first_axis(motion);
    for (uint32_t i = first; i < motion_axes_end(motion); ++i) {
        const struct feedforward_gains gains = gains_of(config, i);
        if (seen == 0u) { /* a motion begins at rest */
            feedforward_begin(&offsets->axes[i], position_q40[i - first]);
        }
        offset[i] = feedforward_next(&offsets->axes[i], &gains, position_q40[i - first]);
    }
}
