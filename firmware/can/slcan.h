/* SPDX-License-Identifier: MIT */
/*
 * slcan: CAN frames as lines of text, in the format of LAWICEL's adapters and their many descendants. Used by
 * sim/gateway and port/mps2.
 *
 *   tiiildd...\r    a frame: identifier (three hex digits), length (one), data (two for each byte)
 *   Sn\r O\r C\r    to an adapter: bit rate (8: 1 Mbit/s), open, close
 *   C\r             from our gateway to a board: close, that is stop the axes and end; from a board: it has ended
 *
 * Other lines (extended and remote frames, answers of an adapter) are ignored. A time stamp (four hex digits after the
 * data) is allowed. Pure, any context; the two directions are independent.
 */
#ifndef CAN_SLCAN_H
#define CAN_SLCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

#define SLCAN_LINE_MAX 22u /* of a frame, with its end */

/* Writes the line, without a 0 at the end. Returns its length. */
uint32_t slcan_encode(const struct can_msg *message, char line[SLCAN_LINE_MAX]);

/* Takes characters one by one. All zero is the beginning. */
struct slcan_decoder {
    char line[SLCAN_LINE_MAX + 4u];
    uint32_t length;  /* characters of the line; more than fits: the line is ignored */
    uint32_t refused; /* lines that began like a frame and were none */
    bool closed;      /* a line C has come */
};

/* True when the character completed a frame: it is in *message. */
bool slcan_decode(struct slcan_decoder *decoder, char character, struct can_msg *message);

#endif
