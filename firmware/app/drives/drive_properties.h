/* SPDX-License-Identifier: MIT */
/* drive_properties: values that a drive reported while it was configured: identity, modes, PDO mapping, position. Used
 * by app/drives. Written by drive_boot, read by homing, drive_polling and the objects 0x2027 ... Main loop. */
#ifndef APP_DRIVES_DRIVE_PROPERTIES_H
#define APP_DRIVES_DRIVE_PROPERTIES_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402.h"

enum drive_property {
    DRIVE_VENDOR,          /* 0x1018 sub 1 */
    DRIVE_PRODUCT,         /* 0x1018 sub 2 */
    DRIVE_REVISION,        /* 0x1018 sub 3 */
    DRIVE_SERIAL,          /* 0x1018 sub 4 */
    DRIVE_MODES,           /* 0x6502: a bit for each mode of operation (CIA402_SUPPORTS) */
    DRIVE_POSITION,        /* 0x6064 before the first write; known if homing is configured */
    DRIVE_INPUTS,          /* 0x60FD exists; its value then */
    DRIVE_INPUTS_MAPPED,   /* and TPDO3 reports its changes */
    DRIVE_TORQUE_MAPPED,   /* RPDO1 takes 0x60B2 */
    DRIVE_VELOCITY_MAPPED, /* RPDO2 takes 0x60B1 */
    DRIVE_NO_PROPERTY,     /* of a step that reads none */
};

#define DRIVE_PROPERTY_COUNT ((unsigned)DRIVE_NO_PROPERTY)

#define DRIVE_VENDOR_SIMULATED  0u /* no real vendor has it */
#define DRIVE_PRODUCT_SIMULATED 2u /* sim/node/drive.eds */

struct drive_properties {
    uint32_t value[DRIVE_PROPERTY_COUNT];
    bool known[DRIVE_PROPERTY_COUNT]; /* else the drive has no such object */
};

/* Stores what the drive reported; DRIVE_NO_PROPERTY is ignored. */
static inline void drive_properties_read(struct drive_properties *properties, unsigned property,
                                         uint32_t value)
{
    if (property < DRIVE_PROPERTY_COUNT) {
        properties->value[property] = value;
        properties->known[property] = true;
    }
}

/* Whether it is a simulated drive of this project. Pure. */
static inline bool drive_is_simulated(const struct drive_properties *properties)
{
    return properties->known[DRIVE_VENDOR] &&
           properties->value[DRIVE_VENDOR] == DRIVE_VENDOR_SIMULATED &&
           properties->known[DRIVE_PRODUCT] &&
           properties->value[DRIVE_PRODUCT] == DRIVE_PRODUCT_SIMULATED;
}

/* Whether 0x6502 has a mode of operation. Pure. */
static inline bool drive_supports(const struct drive_properties *properties, int mode)
{
    return (properties->value[DRIVE_MODES] & CIA402_SUPPORTS(mode)) != 0u;
}

#endif
