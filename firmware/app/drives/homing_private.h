/* SPDX-License-Identifier: MIT */
/* homing_private: what the files of homing share. Under the lock. */
#ifndef APP_DRIVES_HOMING_PRIVATE_H
#define APP_DRIVES_HOMING_PRIVATE_H

#include "app/drives/homing.h"

/* The next phase, which begins now. */
void homing_enter(struct homing *homing, const struct machine *machine, enum homing_phase phase);

/* In the phases OFF, ENABLE, MOVE and DISABLE: what the statusword of the drive leads to. A fault code, or 0. */
uint16_t homing_drive_step(struct homing *homing, struct machine *machine);

#endif
