/* SPDX-License-Identifier: MIT */
/* heartbeat: makes the heartbeat frames of a node (producer, 0x1017) and monitors those of others (consumer, 0x1016);
 * CiA 301, 7.2.8.3.2.2. Used by the controller and by each simulated node. No I/O: the caller sends.
 *
 * Call all functions of one struct from the same context, main loop or timer. They change this struct only. */
#ifndef CANOPEN_HEARTBEAT_H
#define CANOPEN_HEARTBEAT_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/nmt.h"

struct heartbeat_producer {
    uint32_t waited_us;
    uint8_t node;
};

void heartbeat_producer_init(struct heartbeat_producer *producer, uint8_t node);

/* Lets time pass. `period_ms` is the present value of 0x1017; 0: no heartbeat. Nothing is sent in INITIALISING. Returns
 * true when *out is to be sent. After a long pause that is one frame, not one for each period. */
bool heartbeat_producer_process(struct heartbeat_producer *producer, uint16_t period_ms,
                                enum nmt_state state, uint32_t elapsed_us, struct can_msg *out);

enum heartbeat_event {
    HEARTBEAT_NOTHING, /* no change */
    HEARTBEAT_BOOTED,  /* boot-up frame: the node (re)started */
    HEARTBEAT_CHANGED, /* first heartbeat, or the state differs from the last one */
    HEARTBEAT_LOST     /* none for longer than the consumer time; reported once, until the next one
                          comes */
};

enum heartbeat_presence {
    HEARTBEAT_UNKNOWN, /* no heartbeat yet: monitoring starts with the first one */
    HEARTBEAT_PRESENT, /* the last one came within the consumer time */
    HEARTBEAT_MISSING  /* lost; HEARTBEAT_LOST has been reported */
};

/* Monitors one node. */
struct heartbeat_consumer {
    uint32_t time_us;   /* of 0x1016; 0: not monitored, but its states are taken */
    uint32_t waited_us; /* since the last heartbeat */
    enum heartbeat_presence presence;
    enum nmt_state state; /* last one received */
    uint8_t node;
};

void heartbeat_consumer_init(struct heartbeat_consumer *consumer, uint8_t node, uint16_t time_ms);

/* Splits an entry of 0x1016 (CiA 301: bits 16 ... 23 node, 0 ... 15 time in ms). */
void heartbeat_consumer_init_entry(struct heartbeat_consumer *consumer, uint32_t entry);

/* Whether another of `count` entries monitors the node of this one, which is to be entry `at`: CiA 301 allows only
 * one. Pure. */
bool heartbeat_entry_taken(const uint32_t *entries, uint8_t count, uint8_t at, uint32_t entry);

/* Takes a frame; all frames except this node's heartbeat give HEARTBEAT_NOTHING. */
enum heartbeat_event heartbeat_consumer_receive(struct heartbeat_consumer *consumer,
                                                const struct can_msg *in);

/* Lets time pass; HEARTBEAT_LOST once when the consumer time is over. */
enum heartbeat_event heartbeat_consumer_process(struct heartbeat_consumer *consumer,
                                                uint32_t elapsed_us);

#endif
