/* SPDX-License-Identifier: MIT */
/* supervision: supervises the following error and the motor overload of a simulated drive in each period, and stores
 * the effects of injected faults on switches, encoder and supply. It reports conditions; the servo decides the
 * reaction. Used by node/servo. All in one context. Changes only its struct; no I/O.
 */
#ifndef NODE_SUPERVISION_H
#define NODE_SUPERVISION_H

#include <stdbool.h>
#include <stdint.h>

#include "node/axis_motion.h"
#include "node/equipment.h"
#include "od_drive.h"
#include "plant/overload.h"

/* All zero is the beginning, before supervision_equip. */
struct supervision {
    struct overload overload;
    double load_per_volt;  /* motor load in units of the rated torque */
    uint32_t following_us; /* following error out of its window */
    /* injected fault: switches that are on wherever the axis is, bits of 0x60FD */
    uint32_t forced_inputs;
    bool overloaded;
    bool encoder_failed; /* injected fault, as the next one */
    bool supply_failed;
};

/* Ratings of the motor; the overload is cold. */
void supervision_equip(struct supervision *supervision, const struct equipment *equipment,
                       const struct drive_plant *plant);

/* One period. Returns the EMCY code of the error that it finds, EMCY_NO_ERROR: none. The overload trips (EMCY_OVERLOAD,
 * once); if `following`, the following error has been out of its window 0x6065 for longer than 0x6066
 * (EMCY_FOLLOWING_ERROR). */
uint16_t supervision_step(struct supervision *supervision, const struct axis_motion *axis,
                          const struct od_drive *values, bool following);

/* Whether statusword bit 7 (warning) is set: a limit switch is on, or the overload is near. */
bool supervision_warning(const struct supervision *supervision, uint32_t inputs);

/* Whether the cause of a fault persists, so that a fault reset has no effect. */
bool supervision_cause_persists(const struct supervision *supervision);

#endif
