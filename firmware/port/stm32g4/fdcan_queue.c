/* SPDX-License-Identifier: MIT */
#include "port/stm32g4/fdcan_queue.h"

#include <stddef.h>

void fdcan_queue_clear(struct fdcan_queue *queue)
{
    queue->head = 0;
    queue->tail = 0;
}

bool fdcan_queue_put(struct fdcan_queue *queue, const struct can_msg *message)
{
    if (queue->head - queue->tail == FDCAN_QUEUE_SIZE) {
        return false;
    }
    queue->frames[queue->head % FDCAN_QUEUE_SIZE] = *message;
    queue->head++;
    return true;
}

const struct can_msg *fdcan_queue_front(const struct fdcan_queue *queue)
{
    return queue->head == queue->tail ? NULL : &queue->frames[queue->tail % FDCAN_QUEUE_SIZE];
}

void fdcan_queue_drop(struct fdcan_queue *queue)
{
    queue->tail++;
}
