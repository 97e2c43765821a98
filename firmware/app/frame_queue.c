/* SPDX-License-Identifier: MIT */
/* Implements app/frame_queue.h (see there): frames from the receive interrupt to the main loop, in order. Called by
 * app/controller.c. Receive puts frames in, the main loop takes them under the port's lock. Changes only the queue. */
#include "app/frame_queue.h"

void frame_queue_init(struct frame_queue *queue)
{
    queue->head = 0;
    queue->tail = 0;
    queue->lost = 0;
}

bool frame_queue_put(struct frame_queue *queue, const struct can_msg *frame)
{
    const uint32_t waiting = queue->head - queue->tail;
    if (waiting == FRAME_QUEUE_SIZE) {
        queue->lost++;
        return false;
    }
    queue->frames[queue->head % FRAME_QUEUE_SIZE] = *frame;
    queue->head++;
    return waiting == 0u;
}

bool frame_queue_take(struct frame_queue *queue, struct can_msg *frame)
{
    if (queue->head == queue->tail) {
        return false;
    }
    *frame = queue->frames[queue->tail % FRAME_QUEUE_SIZE];
    queue->tail++;
    return true;
}
