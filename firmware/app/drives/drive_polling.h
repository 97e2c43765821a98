/* SPDX-License-Identifier: MIT */
/*
 * drive_polling: reads values of the drives that are in no PDO, for display only: following error (0x60F4), and digital
 * inputs (0x60FD) of drives without a TPDO3 for them. It reads one object of one axis by SDO after the other, each once
 * in DRIVE_POLLING_US.
 *
 * Called by app/controller.c. Main loop; takes the port's lock where it writes to the axes. No I/O: the caller sends.
 */
#ifndef APP_DRIVES_DRIVE_POLLING_H
#define APP_DRIVES_DRIVE_POLLING_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_properties.h"
#include "app/machine/machine.h"
#include "canopen/sdo_client.h"

#define DRIVE_POLLING_US             250000u /* the time from one read of an object to the next */
#define DRIVE_POLLING_SDO_TIMEOUT_US 100000u /* for the answer of a drive */

struct drive_polling {
    struct sdo_client client;
    uint32_t pause_us;
    uint8_t poll_index; /* counts axes and their two objects */
};

void drive_polling_init(struct drive_polling *polling);

/* Takes a frame; ignores all except SDO responses. True when *out is to be sent. */
bool drive_polling_receive(struct drive_polling *polling, const struct can_msg *in,
                           struct can_msg *out);

/* To be called in each round of the main loop. `allowed`: no other module uses the SDO channels of the drives. True
 * when *out is to be sent. */
bool drive_polling_process(struct drive_polling *polling, struct machine *machine,
                           const struct drive_properties *properties, bool allowed,
                           uint32_t elapsed_us, struct can_msg *out);

#endif
