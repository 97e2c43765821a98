/* SPDX-License-Identifier: MIT */
/* frame_bits: how long a frame of classic CAN is (ISO 11898-1; docs/reference/bus-time.md section 1). Pure
 * functions. */
#ifndef HUB_FRAME_BITS_H
#define HUB_FRAME_BITS_H

#include <linux/can.h>

/* Bits from the start bit to the earliest next one: stuff bits counted, the 3 bits of intermission included. Error
 * frames, which come from a controller and not from a bus, have none. */
unsigned frame_bits(const struct can_frame *frame);

#endif
