/* SPDX-License-Identifier: MIT */
/* Implements injector/delay_queue.h (see there): frames that are sent later. Used by injector/forwarder. The functions
 * change their struct only; one thread. */
#include "injector/delay_queue.h"

#include <string.h>

bool delay_queue_put(struct delay_queue *queue, enum fault_side to, const struct can_msg *frame,
                     uint64_t due_ns)
{
    uint32_t at = queue->count;
    if (at == DELAY_QUEUE_FRAMES) {
        return false;
    }
    while (at > 0u && queue->frames[at - 1u].due_ns > due_ns) {
        queue->frames[at] = queue->frames[at - 1u];
        at--;
    }
    queue->frames[at] = (struct delayed_frame){*frame, due_ns, to};
    queue->count++;
    return true;
}

uint64_t delay_queue_due_ns(const struct delay_queue *queue)
{
    return queue->count != 0u ? queue->frames[0].due_ns : UINT64_MAX;
}

bool delay_queue_take(struct delay_queue *queue, uint64_t now_ns, struct delayed_frame *out)
{
    if (delay_queue_due_ns(queue) > now_ns) {
        return false;
    }
    *out = queue->frames[0];
    queue->count--;
    memmove(queue->frames, queue->frames + 1, queue->count * sizeof queue->frames[0]);
    return true;
}
