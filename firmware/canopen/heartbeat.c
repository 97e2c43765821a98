/* SPDX-License-Identifier: MIT */
/* Implements canopen/heartbeat.h (see there): heartbeat producer (0x1017) and consumer (0x1016). Used by the
 * controller and by each simulated node. No I/O: the caller sends. */
#include "canopen/heartbeat.h"

#include "canopen/cob.h"

#define US_PER_MS 1000u

/* a + b, or the largest value */
static uint32_t add_saturating(uint32_t a, uint32_t b)
{
    return a > UINT32_MAX - b ? UINT32_MAX : a + b;
}

void heartbeat_producer_init(struct heartbeat_producer *producer, uint8_t node)
{
    producer->waited_us = 0;
    producer->node = node;
}

bool heartbeat_producer_process(struct heartbeat_producer *producer, uint16_t period_ms,
                                enum nmt_state state, uint32_t elapsed_us, struct can_msg *out)
{
    uint32_t period_us = period_ms * US_PER_MS;

    if (period_us == 0 || state == NMT_INITIALISING) {
        producer->waited_us = 0;
        return false;
    }
    producer->waited_us = add_saturating(producer->waited_us, elapsed_us);
    if (producer->waited_us < period_us) {
        return false;
    }
    producer->waited_us -= period_us;
    if (producer->waited_us >= period_us) {
        producer->waited_us = 0;
    }
    cob_frame(out, COB_HEARTBEAT + producer->node, 1);
    out->data[0] = (uint8_t)state;
    return true;
}

void heartbeat_consumer_init(struct heartbeat_consumer *consumer, uint8_t node, uint16_t time_ms)
{
    consumer->time_us = time_ms * US_PER_MS;
    consumer->waited_us = 0;
    consumer->presence = HEARTBEAT_UNKNOWN;
    consumer->state = NMT_INITIALISING;
    consumer->node = node;
}

void heartbeat_consumer_init_entry(struct heartbeat_consumer *consumer, uint32_t entry)
{
    heartbeat_consumer_init(consumer, (uint8_t)((entry >> 16) & NODE_ID_MAX),
                            (uint16_t)(entry & 0xFFFFu));
}

static bool is_used(uint32_t entry)
{
    return ((entry >> 16) & 0xFFu) != 0u && (entry & 0xFFFFu) != 0u;
}

bool heartbeat_entry_taken(const uint32_t *entries, uint8_t count, uint8_t at, uint32_t entry)
{
    for (uint8_t i = 0; i < count; ++i) {
        const bool same_node = ((entries[i] ^ entry) & 0xFF0000u) == 0u;
        if (i != at && same_node && is_used(entries[i]) && is_used(entry)) {
            return true;
        }
    }
    return false;
}

enum heartbeat_event heartbeat_consumer_receive(struct heartbeat_consumer *consumer,
                                                const struct can_msg *in)
{
    enum heartbeat_presence before = consumer->presence;
    enum nmt_state state = (enum nmt_state)(in->data[0] & 0x7Fu);
    bool changed = before != HEARTBEAT_PRESENT || state != consumer->state;

    if (consumer->node == 0 || in->id != COB_HEARTBEAT + consumer->node || in->len != 1) {
        return HEARTBEAT_NOTHING;
    }
    consumer->waited_us = 0;
    consumer->state = state;
    if (state == NMT_INITIALISING) {
        /* A boot-up frame is no heartbeat: monitoring waits for the first one. */
        consumer->presence = HEARTBEAT_UNKNOWN;
        return HEARTBEAT_BOOTED;
    }
    consumer->presence = HEARTBEAT_PRESENT;
    return changed ? HEARTBEAT_CHANGED : HEARTBEAT_NOTHING;
}

enum heartbeat_event heartbeat_consumer_process(struct heartbeat_consumer *consumer,
                                                uint32_t elapsed_us)
{
    if (consumer->presence != HEARTBEAT_PRESENT || consumer->time_us == 0) {
        return HEARTBEAT_NOTHING;
    }
    consumer->waited_us = add_saturating(consumer->waited_us, elapsed_us);
    if (consumer->waited_us <= consumer->time_us) {
        return HEARTBEAT_NOTHING;
    }
    consumer->presence = HEARTBEAT_MISSING;
    return HEARTBEAT_LOST;
}
