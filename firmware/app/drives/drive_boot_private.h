/* SPDX-License-Identifier: MIT */
/* drive_boot_private: what the files of drive_boot share. Mainline. */
#ifndef APP_DRIVES_DRIVE_BOOT_PRIVATE_H
#define APP_DRIVES_DRIVE_BOOT_PRIVATE_H

#include "app/drives/drive_boot.h"

/* The next attempt begins after a pause. */
void drive_boot_pause(struct drive_boot *boot, uint32_t pause_us);

/* Node of the axis that is being configured. */
uint8_t drive_boot_node(const struct drive_boot *boot);

/* This attempt has failed at the present object: noted as trouble; the next one begins after DRIVE_BOOT_RETRY_US. */
void drive_boot_give_up(struct drive_boot *boot, uint32_t abort_code, uint32_t value);

/* To the next object of the drive. */
void drive_boot_advance(struct drive_boot *boot);

/* The SDO transfer of the present object is over: decides what follows. */
void drive_boot_response(struct drive_boot *boot);

#endif
