/* SPDX-License-Identifier: MIT */
/* equipment: limit and home switches, ratings, holding brake and friction of a simulated axis. Used by sim/node only.
 *
 * The places of the switches are in the coordinates of the axis at power-on. Homing changes the coordinates, not the
 * switches. Any thread; equipment_init writes the caller's struct, the other functions change nothing. No I/O.
 */
#ifndef NODE_EQUIPMENT_H
#define NODE_EQUIPMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive_config.h"

/* Bits of the digital inputs 0x60FD (CiA 402-2). */
#define EQUIPMENT_INPUT_NEGATIVE UINT32_C(1)
#define EQUIPMENT_INPUT_POSITIVE UINT32_C(2)
#define EQUIPMENT_INPUT_HOME     UINT32_C(4)

/* The place of a switch that does not exist. */
#define EQUIPMENT_NOWHERE 1e12

struct equipment {
    double limit_negative_mm; /* switch on at and below; -EQUIPMENT_NOWHERE: none */
    double limit_positive_mm; /* switch on at and above; EQUIPMENT_NOWHERE: none */
    double home_from_mm;      /* home switch on from this place ... */
    double home_to_mm;        /* ... to this place; less than home_from_mm: no home switch */
    double rated_torque_nm;   /* more than 0 */
    double rated_current_a;   /* more than 0 */
    double overload_s;        /* from cold to the overload trip at the full voltage; 0: never */
    double friction_volts;    /* Coulomb friction, as the voltage that overcomes it; 0 or more */
    double brake_volts;       /* of the holding brake, as friction; more than 0 */
    uint32_t serial;          /* 0x1018 sub 4 */
    uint32_t vendor;          /* 0x1018 sub 1; not 0: a controller treats it as a real drive */
};

/* No switches, no friction; rated torque half of what the voltage limit gives, 5 A, 10 s of overload; a brake as strong
 * as the motor. */
void equipment_init(struct equipment *equipment, const struct drive_config *config);

/* Whether all values are in their ranges. equipment_rule: these ranges in words, for an error message. */
bool equipment_ok(const struct equipment *equipment);
extern const char equipment_rule[];

/* The switches, as bits of 0x60FD, at a place of the machine. */
uint32_t equipment_inputs(const struct equipment *equipment, double machine_mm);

#endif
