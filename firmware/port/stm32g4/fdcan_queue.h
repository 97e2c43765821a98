/* SPDX-License-Identifier: MIT */
/* fdcan_queue: frames of one context that wait for the transmitter, in order. Nobody else at the same time. */
#ifndef PORT_STM32G4_FDCAN_QUEUE_H
#define PORT_STM32G4_FDCAN_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

/* A tick has at most 13 frames (SYNC, position and velocity of six axes). Not many more, so that a bus that comes back
 * is not given old setpoints for long. */
#define FDCAN_QUEUE_SIZE 16u

struct fdcan_queue {
    uint32_t head; /* frames ever put in; wraps */
    uint32_t tail; /* frames ever taken out */
    struct can_msg frames[FDCAN_QUEUE_SIZE];
};

void fdcan_queue_clear(struct fdcan_queue *queue);

/* False: no room. */
bool fdcan_queue_put(struct fdcan_queue *queue, const struct can_msg *message);

/* The oldest, which stays; NULL: none. */
const struct can_msg *fdcan_queue_front(const struct fdcan_queue *queue);
void fdcan_queue_drop(struct fdcan_queue *queue);

#endif
