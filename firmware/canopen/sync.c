/* SPDX-License-Identifier: MIT */
/* Implements canopen/sync.h (see there): SYNC with counter, producer and consumer. Used by app/tick and
 * sim/node/sync_clock. No I/O; changes its struct only. */
#include "canopen/sync.h"

#include "canopen/cob.h"

void sync_producer_init(struct sync_producer *producer, uint8_t overflow)
{
    producer->overflow = overflow;
    cob_frame(&producer->frame, COB_SYNC, overflow == 0 ? 0 : 1);
}

const struct can_msg *sync_producer_next(struct sync_producer *producer)
{
    const uint8_t counter = producer->frame.data[0];

    if (producer->overflow != 0) {
        producer->frame.data[0] = counter >= producer->overflow ? 1u : (uint8_t)(counter + 1u);
    }
    return &producer->frame;
}

void sync_consumer_init(struct sync_consumer *consumer, uint8_t overflow)
{
    consumer->overflow = overflow;
    consumer->counter = 0;
}

int sync_consumer_receive(struct sync_consumer *consumer, const struct can_msg *in)
{
    int difference = 1;
    uint8_t counter = in->data[0];

    if (in->id != COB_SYNC) {
        return SYNC_NONE;
    }
    if (in->len != (consumer->overflow == 0 ? 0 : 1)) {
        return SYNC_ERR_LENGTH;
    }
    if (consumer->overflow == 0) {
        return difference;
    }
    if (counter == 0 || counter > consumer->overflow) {
        return SYNC_ERR_COUNTER;
    }
    if (consumer->counter != 0) {
        difference = (counter + consumer->overflow - consumer->counter) % consumer->overflow;
    }
    consumer->counter = counter;
    return difference;
}
