/* SPDX-License-Identifier: MIT */
/*
 * offsets: velocity and torque offsets that feedforward (core/feedforward) adds to the setpoints of a motion.
 *
 * Called by app/tick after the machine's step, while feedforward is configured. Timer; offsets_init in the main loop.
 * Changes only its struct.
 */
#ifndef APP_MACHINE_OFFSETS_H
#define APP_MACHINE_OFFSETS_H

#include <stdint.h>

#include "app/machine/config.h"
#include "app/machine/motion.h"
#include "core/feedforward.h"

struct offsets {
    struct feedforward axes[AXES_MAX];
    uint32_t setpoints; /* of the motion, at the last call; 0: none */
};

void offsets_init(struct offsets *offsets);

/* Offsets of this tick's setpoints, by axis of the machine; 0 where the motion gave no new setpoint. `motion`: after
 * its step; NULL when no motion runs. Call it once a tick. Timer. */
void offsets_step(struct offsets *offsets, const struct config *config, const struct motion *motion,
                  struct feedforward_offset offset[AXES_MAX]);

#endif
