/* SPDX-License-Identifier: MIT */
/*
 * exchange: the messages between the emulated board and the gateway (sim/gateway) on the two FIFOs: a request of the
 * board, then a reply of the gateway, and so on. Little-endian, as both are; a message is one write of at most 4096
 * bytes, which a pipe takes as a whole. docs/guides/target.md has their order.
 *
 * Plain data, and pure functions for any context. Used by port/mps2/link_fifo and sim/gateway.
 */
#ifndef PORT_MPS2_EXCHANGE_H
#define PORT_MPS2_EXCHANGE_H

#include <stdint.h>
#include <string.h>

#include "can/can_frame.h"

#define EXCHANGE_FRAMES 255u

/* The layout of struct can_frame in <linux/can.h>. */
struct exchange_frame {
    uint32_t id;
    uint8_t len;
    uint8_t
        of_tick; /* request: 1: the next tick needs to know whether this frame has been sent on the bus */
    uint8_t reserved[2];
    uint8_t data[CAN_DATA_MAX];
};

enum exchange_request_flag {
    EXCHANGE_TICK = 1, /* the first request after a tick; it has the tick's frames */
    /* answers are awaited: the reply may come before the next tick is due, with frames */
    EXCHANGE_AWAIT = 2,
    /* with TICK: the next tick may come before its time, as soon as nothing is awaited */
    EXCHANGE_HURRY = 4,
    EXCHANGE_READY = 8,   /* all awaited answers have come */
    EXCHANGE_FILTER = 16, /* the records are filters: id, and the mask in data[0] and data[1] */
    EXCHANGE_END = 32,    /* the last request */
};

enum exchange_reply_flag {
    EXCHANGE_DUE = 1,     /* the next tick is due */
    EXCHANGE_STOP = 2,    /* the controller has to end */
    EXCHANGE_WAITING = 4, /* frames of ticks still wait for the bus */
};

/* Before the frames of either message. */
struct exchange_header {
    uint16_t count;     /* frames that follow */
    uint16_t flags;     /* exchange_request_flag or exchange_reply_flag */
    uint32_t period_us; /* request: up to the next tick */
    /* request, with TICK and AWAIT: the next tick is due after this time at the latest */
    uint32_t guard_us;
    uint32_t late_ns; /* reply, with DUE: how late it is */
};

struct exchange_message {
    struct exchange_header header;
    struct exchange_frame frames[EXCHANGE_FRAMES];
};

static inline uint32_t exchange_size(const struct exchange_message *message)
{
    return (uint32_t)sizeof message->header +
           message->header.count * (uint32_t)sizeof message->frames[0];
}

static inline void exchange_pack(struct exchange_frame *frame, const struct can_msg *message)
{
    memset(frame, 0, sizeof *frame);
    frame->id = message->id;
    frame->len = message->len;
    memcpy(frame->data, message->data, CAN_DATA_MAX);
}

static inline void exchange_unpack(struct can_msg *message, const struct exchange_frame *frame)
{
    message->id = frame->id;
    message->len = frame->len;
    memcpy(message->data, frame->data, CAN_DATA_MAX);
}

#endif
