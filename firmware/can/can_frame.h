/* SPDX-License-Identifier: MIT */
/* can_frame: one classic CAN data frame, as the protocol objects and the ports exchange it. Used by the whole
 * firmware except its core, and by the simulated nodes and bus programs. Plain data.
 *
 * Only base frames (11-bit identifier, no remote frames) exist here: a port drops everything else
 * at its boundary. Bytes of `data` from `len` on have no meaning on receipt and are zero in frames
 * made by canopen/.
 */
#ifndef CAN_CAN_FRAME_H
#define CAN_CAN_FRAME_H

#include <stdint.h>

#define CAN_DATA_MAX 8u
#define CAN_ID_MAX   0x7FFu

struct can_msg {
    uint32_t id; /* 0 ... CAN_ID_MAX */
    uint8_t len; /* 0 ... CAN_DATA_MAX */
    uint8_t data[CAN_DATA_MAX];
};

#endif
