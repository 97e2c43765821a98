/* SPDX-License-Identifier: MIT */
/* delay_queue: keeps frames until they are due. Bounded, no heap. Used by injector/forwarder. The functions change
 * their struct only; one thread. */
#ifndef INJECTOR_DELAY_QUEUE_H
#define INJECTOR_DELAY_QUEUE_H

#include "can/can_frame.h"
#include "faults/fault_rules.h"

#define DELAY_QUEUE_FRAMES 256u

struct delayed_frame {
    struct can_msg frame;
    uint64_t due_ns;
    enum fault_side to;
};

/* All zero is empty. */
struct delay_queue {
    struct delayed_frame frames[DELAY_QUEUE_FRAMES]; /* in the order of due_ns */
    uint32_t count;
};

/* False when the queue is full. Frames due at the same instant keep their order. */
bool delay_queue_put(struct delay_queue *queue, enum fault_side to, const struct can_msg *frame,
                     uint64_t due_ns);

/* When the first is due, UINT64_MAX when there is none. */
uint64_t delay_queue_due_ns(const struct delay_queue *queue);

/* Takes the first if it is due. */
bool delay_queue_take(struct delay_queue *queue, uint64_t now_ns, struct delayed_frame *out);

#endif
