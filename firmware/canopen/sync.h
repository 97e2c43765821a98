/* SPDX-License-Identifier: MIT */
/*
 * sync: produces and consumes SYNC frames with a counter (CiA 301, 7.2.5; objects 0x1005, 0x1006, 0x1019). The tick of
 * the controller is the producer, each simulated drive a consumer. Used by app/tick and sim/node/sync_clock. The caller
 * decides when a SYNC is due. No I/O; changes its struct only.
 */
#ifndef CANOPEN_SYNC_H
#define CANOPEN_SYNC_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

/* Values of 0x1019 that CiA 301 allows: 0 (no counter), 2 ... 240. */
#define SYNC_OVERFLOW_MAX 240u

struct sync_producer {
    struct can_msg frame; /* the last SYNC; its counter is 0 before the first */
    uint8_t overflow;     /* 0x1019 */
};

/* Timer (or before it starts). `overflow` is 0x1019. */
void sync_producer_init(struct sync_producer *producer, uint8_t overflow);

/* The next SYNC; its counter goes from 1 to the overflow value, then from 1 again. Valid until the next call. Timer. */
const struct can_msg *sync_producer_next(struct sync_producer *producer);

struct sync_consumer {
    uint8_t overflow;
    uint8_t counter; /* of the last SYNC; 0 before the first */
};

#define SYNC_NONE        (-1) /* not a SYNC frame */
#define SYNC_ERR_LENGTH  (-2) /* length does not fit 0x1019 */
#define SYNC_ERR_COUNTER (-3) /* counter 0 or above the overflow value */

/* `overflow` is 0x1019. Before the first frame. */
void sync_consumer_init(struct sync_consumer *consumer, uint8_t overflow);

/* Periods since the SYNC before: 1 normally and for the first one, more when SYNCs were lost, 0 for
 * a repeated counter; or a negative code above, with nothing changed. Without counter (overflow 0):
 * 1 for each. Receive interrupt. */
int sync_consumer_receive(struct sync_consumer *consumer, const struct can_msg *in);

#endif
