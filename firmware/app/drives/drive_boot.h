/* SPDX-License-Identifier: MIT */
/*
 * drive_boot: finds the drives and the I/O module, configures them by SDO (drive_configuration) and starts them (NMT),
 * one after the other, and begins again from the first when one does not answer or refuses.
 *
 * A refused write is no error if the object already has the value. So a drive with a fixed PDO mapping is
 * accepted if the mapping is the right one.
 *
 * Called by app/controller.c. Frames in, frames out; main loop. Changes only its struct.
 */
#ifndef APP_DRIVES_DRIVE_BOOT_H
#define APP_DRIVES_DRIVE_BOOT_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_configuration.h"
#include "app/drives/drive_properties.h"
#include "app/machine/config.h"
#include "canopen/sdo_client.h"

/* Times of an attempt. */
#define DRIVE_BOOT_SDO_TIMEOUT_US 500000u /* for the answer of a drive */
#define DRIVE_BOOT_PAUSE_US      20000u /* hosts write several objects at once: wait for the last */
#define DRIVE_BOOT_RETRY_US      200000u /* from a failed attempt to the next one */
#define DRIVE_BOOT_READ_AGAIN_US 5000u   /* a value that a drive takes over in its own cycle */
#define DRIVE_BOOT_READS         20u     /* most reads of one object until it has the value */

enum drive_boot_phase {
    DRIVE_BOOT_IDLE,      /* no attempt has begun */
    DRIVE_BOOT_PAUSE,     /* before the first drive, or before the next attempt */
    DRIVE_BOOT_CONFIGURE, /* the I/O module or the drive of `configuration` */
    DRIVE_BOOT_START,     /* all are configured; `axis` is to be started next */
    DRIVE_BOOT_DONE,      /* all are configured and started */
};

/* Object 0x2025: what the last attempt failed at. */
struct drive_trouble {
    uint8_t node;        /* 0: none */
    uint32_t object;     /* index << 8 + sub */
    uint32_t abort_code; /* SDO_OK: it answered with another value */
    uint32_t value;      /* that value, where there is one */
};

struct drive_boot {
    struct sdo_client client;
    struct config config;
    struct drive_configuration configuration;
    struct drive_op op;
    /* of the drives, then of the I/O module */
    struct drive_properties properties[DRIVE_NODES];
    struct drive_trouble trouble;
    enum drive_boot_phase phase;
    uint32_t pause_us;
    uint32_t refused_code; /* abort code of the refused write that is now read back */
    /* index of the axis whose drive is configured or started; axis_count of the configuration: the I/O module */
    uint8_t axis;
    uint8_t reads; /* of the present object, without the right answer */
    bool reading_back;
    bool simulated; /* all drives up to this one are simulated (0x1018) */
};

void drive_boot_init(struct drive_boot *boot);

/* Begins an attempt; ends one that is under way. */
void drive_boot_begin(struct drive_boot *boot, const struct config *config);

/* Takes a frame; ignores all except SDO responses. Returns true when *out is to be sent. */
bool drive_boot_receive(struct drive_boot *boot, const struct can_msg *in, struct can_msg *out);

/* Lets time pass. Returns true when *out is to be sent: then call again with elapsed_us 0. */
bool drive_boot_process(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out);

/* Reports a drive that was configured and started but sends no process data: trouble with object 0, until the next
 * attempt begins; node 0: no trouble. During an attempt it does nothing. */
void drive_boot_unresponsive(struct drive_boot *boot, uint8_t node);

/* True once after an attempt that reached every drive. */
bool drive_boot_finished(struct drive_boot *boot);

#endif
