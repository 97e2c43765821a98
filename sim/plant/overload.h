/* SPDX-License-Identifier: MIT */
/* Thermal model of a motor and its power stage (I2t): a store that fills with the square of the
 * load and empties by what rated load would give off.
 *
 *     heat' = (load / rated)^2 - 1, not below 0                [s]
 *
 * So rated load may last for ever, and `peak` times the rated load trips after the time given;
 * without load a full store is empty after level_s. Pure functions.
 */
#ifndef HODOGRAPH_PLANT_OVERLOAD_H
#define HODOGRAPH_PLANT_OVERLOAD_H

#include <stdbool.h>
#include <stdint.h>

struct overload {
    double heat_s;
    double level_s; /* trips above; 0: never */
};

/* peak: more than 1, else the store never fills; time_s: from cold to the trip at peak load. */
void overload_init(struct overload *overload, double peak, double time_s);

/* Lets time pass under `load`, in units of the rated load. */
void overload_step(struct overload *overload, double load, double time_s);

/* Whether the store holds more than this part of the level that trips. */
bool overload_above(const struct overload *overload, double part);

/* The store's level, per mille of that which trips. */
uint16_t overload_permille(const struct overload *overload);

#endif
