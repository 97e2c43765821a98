/* SPDX-License-Identifier: MIT */
/* drive_properties: what a drive said about itself while it was configured. Main loop. */
#ifndef APP_DRIVES_DRIVE_PROPERTIES_H
#define APP_DRIVES_DRIVE_PROPERTIES_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402.h"

enum drive_fact {
    DRIVE_VENDOR, /* 0x1018 subs 1 ... 4 */
    DRIVE_PRODUCT,
    DRIVE_REVISION,
    DRIVE_SERIAL,
    DRIVE_MODES,           /* 0x6502 */
    DRIVE_POSITION,        /* 0x6064 before anything was written; known where homing is requested */
    DRIVE_INPUTS,          /* 0x60FD exists; its value then */
    DRIVE_INPUTS_MAPPED,   /* and TPDO3 reports its changes */
    DRIVE_TORQUE_MAPPED,   /* RPDO1 takes 0x60B2 */
    DRIVE_VELOCITY_MAPPED, /* RPDO2 takes 0x60B1 */
    DRIVE_NO_FACT,         /* of a step that learns nothing */
};

#define DRIVE_FACTS ((unsigned)DRIVE_NO_FACT)

#define DRIVE_VENDOR_SIMULATED  0u /* no real vendor has it */
#define DRIVE_PRODUCT_SIMULATED 2u /* sim/node/drive.eds */

struct drive_properties {
    uint32_t value[DRIVE_FACTS];
    bool known[DRIVE_FACTS]; /* else the drive has no such object */
};

static inline void drive_properties_read(struct drive_properties *facts, unsigned fact,
                                         uint32_t value)
{
    if (fact < DRIVE_FACTS) {
        facts->value[fact] = value;
        facts->known[fact] = true;
    }
}

/* Whether it is one of the project's simulated drives. Pure. */
static inline bool drive_is_simulated(const struct drive_properties *facts)
{
    return facts->known[DRIVE_VENDOR] && facts->value[DRIVE_VENDOR] == DRIVE_VENDOR_SIMULATED &&
           facts->known[DRIVE_PRODUCT] && facts->value[DRIVE_PRODUCT] == DRIVE_PRODUCT_SIMULATED;
}

/* Whether 0x6502 has a mode of operation. Pure. */
static inline bool drive_supports(const struct drive_properties *facts, int mode)
{
    return (facts->value[DRIVE_MODES] & CIA402_SUPPORTS(mode)) != 0u;
}

#endif
