/* SPDX-License-Identifier: MIT */
/* frame_queue: passes frames from the receive interrupt to the main loop, in their order. One producer, one consumer.
 * Called by app/controller.c. Receive puts frames in, the main loop takes them under the port's lock. The functions
 * change only the queue. */
#ifndef APP_FRAME_QUEUE_H
#define APP_FRAME_QUEUE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

/* An SDO block of 127 segments comes without a pause, with other frames between. */
#define FRAME_QUEUE_SIZE 256u

struct frame_queue {
    uint32_t head; /* frames ever put in; wraps */
    uint32_t tail; /* frames ever taken out */
    uint32_t lost; /* frames lost because the queue was full */
    struct can_msg frames[FRAME_QUEUE_SIZE];
};

void frame_queue_init(struct frame_queue *queue);

/* Returns true when the queue was empty, so that the main loop may have to be woken. Receive. */
bool frame_queue_put(struct frame_queue *queue, const struct can_msg *frame);

/* Takes the oldest; false when there is none. Under the lock. */
bool frame_queue_take(struct frame_queue *queue, struct can_msg *frame);

#endif
