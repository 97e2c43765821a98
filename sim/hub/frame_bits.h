/* SPDX-License-Identifier: MIT */
/* frame_bits: the number of bits of a classic CAN frame (ISO 11898-1; docs/reference/bus-time.md section 1). Used by
 * sim/hub/hub. Pure. */
#ifndef HUB_FRAME_BITS_H
#define HUB_FRAME_BITS_H

#include <linux/can.h>

/* Bits from the start bit to the earliest next one, with stuff bits and the 3 bits of intermission. 0 for error frames,
 * which a CAN controller reports and no bus carries. */
unsigned frame_bits(const struct can_frame *frame);

#endif
