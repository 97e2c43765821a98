/* SPDX-License-Identifier: MIT */
/*
 * homing_mode: brings a drive into a mode of operation by SDO: writes 0x6060, then reads 0x6061 until the drive has the
 * mode. Used by app/drives/homing. No I/O; changes its struct only.
 *
 *     homing_mode_begin(&mode);
 *     each poll: if (homing_mode_process(&mode, node, 6, elapsed_us, &out, &result)) -> send out
 *     each frame: sdo_client_receive(&mode.client, ...)
 *     until result is not HOMING_MODE_PENDING
 *
 * Main loop.
 */
#ifndef APP_DRIVES_HOMING_MODE_H
#define APP_DRIVES_HOMING_MODE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/sdo_client.h"

#define HOMING_MODE_SDO_TIMEOUT_US 500000u /* for the answer of the drive */
#define HOMING_MODE_READ_AGAIN_US  5000u   /* between two reads of 0x6061 */
#define HOMING_MODE_READS          20u     /* of 0x6061, until it is the mode */

enum homing_mode_result {
    HOMING_MODE_PENDING, /* not decided yet */
    HOMING_MODE_SET,     /* the drive has the mode */
    HOMING_MODE_REFUSED, /* `detail`: the abort code, or the mode that 0x6061 stays at */
};

struct homing_mode {
    struct sdo_client client;
    uint32_t pause_us;
    uint32_t detail;
    uint8_t reads;
    bool checking; /* 0x6061 is being read */
};

void homing_mode_init(struct homing_mode *mode);

/* Begins with a mode or drive; drops a transfer that is under way. */
void homing_mode_begin(struct homing_mode *mode);

/* Lets time pass. Returns true when *out is to be sent. */
bool homing_mode_process(struct homing_mode *mode, uint8_t node, uint8_t wanted,
                         uint32_t elapsed_us, struct can_msg *out, enum homing_mode_result *result);

#endif
