/* SPDX-License-Identifier: MIT */
/*
 * drive_polling: reads a few times a second what no PDO carries: following error (0x60F4) and, where a drive has no
 * TPDO3 for them, digital inputs (0x60FD). Axis after axis by SDO, each about DRIVE_POLLING_US apart.
 *
 * Main loop; takes the port's lock where it touches the machine.
 */
#ifndef APP_DRIVES_DRIVE_POLLING_H
#define APP_DRIVES_DRIVE_POLLING_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_properties.h"
#include "app/machine/machine.h"
#include "canopen/sdo_client.h"

#define DRIVE_POLLING_US             250000u
#define DRIVE_POLLING_SDO_TIMEOUT_US 100000u

struct drive_polling {
    struct sdo_client client;
    uint32_t pause_us;
    uint8_t poll_index; /* counts axes and their two objects */
};

void drive_polling_init(struct drive_polling *polling);

/* Takes a frame; others than SDO answers are ignored. True when *out is to be sent. */
bool drive_polling_receive(struct drive_polling *polling, const struct can_msg *in,
                           struct can_msg *out);

/* Lets time pass. `allowed`: nobody else uses the SDO channels of the drives. True when *out is to be sent. */
bool drive_polling_process(struct drive_polling *polling, struct machine *machine,
                           const struct drive_properties *facts, bool allowed, uint32_t elapsed_us,
                           struct can_msg *out);

#endif
