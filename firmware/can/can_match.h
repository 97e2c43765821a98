/* SPDX-License-Identifier: MIT */
/* can_match: which frames a node receives, in the form of acceptance filters. Used by the ports. Pure. */
#ifndef CAN_CAN_MATCH_H
#define CAN_CAN_MATCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/can_frame.h"

/* 11-bit identifiers; a frame passes when (frame.id & mask) == (id & mask). */
struct can_match {
    uint16_t id;
    uint16_t mask;
};

/* True when the frame passes one of them. Any context. */
static inline bool can_match_any(const struct can_match *filters, size_t count,
                                 const struct can_msg *message)
{
    for (size_t i = 0; i < count; ++i) {
        if (((message->id ^ filters[i].id) & filters[i].mask) == 0u) {
            return true;
        }
    }
    return false;
}

#endif
