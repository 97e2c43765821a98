/* SPDX-License-Identifier: MIT */
/* drive_errors: reports errors of a simulated drive: error code 0x603F, error register 0x1001, history 0x1003, EMCY. It
 * does not change the motion: the reaction to an error is in node/servo. Used by node/servo, node/drive_pdos and
 * node/drive_node. All in one context. Changes its struct and the values of the dictionary; no I/O, since
 * node/drive_node sends the EMCY.
 */
#ifndef NODE_DRIVE_ERRORS_H
#define NODE_DRIVE_ERRORS_H

#include <stdint.h>

#include "canopen/emcy.h"
#include "canopen/pdo_map.h"
#include "od_drive.h"

struct drive_errors {
    struct emcy_producer emcy;
    struct od_drive *values; /* borrowed: the object dictionary */
    uint8_t short_rpdos;     /* a bit for each RPDO whose last frame was too short */
};

/* No error. Clears 0x1001 and 0x1003; `values` must stay valid. */
void drive_errors_init(struct drive_errors *errors, uint8_t id, struct od_drive *values);

/* Reports a new error. `detail`: first manufacturer byte of its EMCY. */
void drive_errors_report(struct drive_errors *errors, uint16_t code, uint8_t detail);

/* A frame for RPDO number `i` (from 0) was too short; only the first one of a series is reported. */
void drive_errors_rpdo_short(struct drive_errors *errors, int i, const struct pdo_map *map,
                             const struct can_msg *in);

/* A frame for RPDO number `i` was long enough; to be called while `short_rpdos` is not 0. Ends the error if no other
 * RPDO has it and no other communication error is present. */
void drive_errors_rpdo_good(struct drive_errors *errors, int i);

/* Ends all errors. */
void drive_errors_clear(struct drive_errors *errors);

#endif
