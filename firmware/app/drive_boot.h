/* SPDX-License-Identifier: MIT */
/*
 * drive_boot: finds the drives, configures them by SDO and starts them (NMT), one after the other,
 * and begins again from the first when one does not answer or refuses.
 *
 * Frames in, frames out; mainline.
 */
#ifndef APP_DRIVE_BOOT_H
#define APP_DRIVE_BOOT_H

#include <stdbool.h>
#include <stdint.h>

#include "app/config.h"
#include "canopen/sdo_client.h"

#define DRIVE_BOOT_SDO_TIMEOUT_US 500000u
#define DRIVE_BOOT_PAUSE_US 20000u /* hosts write several objects at once: wait for the last */
#define DRIVE_BOOT_RETRY_US 200000u
#define DRIVE_HEARTBEAT_MS  100u

enum drive_boot_phase {
    DRIVE_BOOT_IDLE,
    DRIVE_BOOT_PAUSE,     /* before the first drive, or before the next attempt */
    DRIVE_BOOT_CONFIGURE, /* `axis` at `step` */
    DRIVE_BOOT_START,     /* all are configured; `axis` is to be started next */
    DRIVE_BOOT_DONE,
};

struct drive_boot {
    struct sdo_client client;
    struct config config;
    enum drive_boot_phase phase;
    uint32_t pause_us;
    uint8_t axis;
    uint8_t step;
    bool simulated;          /* every drive so far is one of ours (0x1018) */
    uint8_t trouble_node;    /* the drive that the last attempt failed at; 0: none */
    uint32_t trouble_object; /* index << 8 + sub that it was about */
    uint32_t trouble_abort;  /* its SDO abort code; 0: it answered with a wrong value */
    uint32_t trouble_value;  /* that value */
};

void drive_boot_init(struct drive_boot *boot);

/* Begins, also in the middle of an attempt. */
void drive_boot_begin(struct drive_boot *boot, const struct config *config);

/* Takes a frame; others than SDO answers are ignored. Returns 1 when *out is to be sent, else 0. */
int drive_boot_receive(struct drive_boot *boot, const struct can_msg *in, struct can_msg *out);

/* Lets time pass. Returns 1 when *out is to be sent: then call again with elapsed_us 0; else 0. */
int drive_boot_process(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out);

/* True once after an attempt that reached every drive. */
bool drive_boot_finished(struct drive_boot *boot);

#endif
