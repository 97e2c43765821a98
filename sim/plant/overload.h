/* SPDX-License-Identifier: MIT */
/* overload: thermal model of a motor and its power stage (I2t): heat that rises with the square of the load and falls
 * by the losses at rated load. Used by node/supervision and node/servo.
 *
 *     heat' = (load / rated)^2 - 1, not below 0                [s]
 *
 * So rated load may last for ever, and `peak` times the rated load trips after the given time; without load the heat is
 * 0 again after level_s. The functions change their struct only; any thread.
 */
#ifndef HODOGRAPH_PLANT_OVERLOAD_H
#define HODOGRAPH_PLANT_OVERLOAD_H

#include <stdbool.h>
#include <stdint.h>

struct overload {
    double heat_s;
    double level_s; /* trips above; 0: never */
};

/* peak: more than 1, else it never trips; time_s: from cold to the trip at peak load. */
void overload_init(struct overload *overload, double peak, double time_s);

/* Lets time pass under `load`, in units of the rated load. */
void overload_step(struct overload *overload, double load, double time_s);

/* Whether the heat is above this part of the level that trips. */
bool overload_above(const struct overload *overload, double part);

/* The heat, per mille of the level that trips. */
uint16_t overload_permille(const struct overload *overload);

#endif
