/* SPDX-License-Identifier: MIT */
/* offsets: what feedforward (core/feedforward) adds to the setpoints of a motion, by axis of the path.
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

/* Offsets of this tick's setpoints, zero when the motion gave no new ones; `motion` after its step,
 * or NULL when none is under way. Once a tick while feedforward is configured. Timer. */
void offsets_step(struct offsets *offsets, const struct config *config, const struct motion *motion,
                  struct feedforward_offset offset[AXES_MAX]);

#endif
