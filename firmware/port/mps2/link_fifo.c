/* SPDX-License-Identifier: MIT */
/* link_fifo of port/mps2/link.h: in each tick it sends all frames and receives those that came, as if by an interrupt
 * right after the tick. Used by port/mps2 only. Main loop and interrupts, as struct link states. Reads and writes the
 * two FIFOs by semihosting. */
#include "port/cortex_m/core.h"
#include "port/cortex_m/systick.h"
#include "port/mps2/exchange.h"
#include "port/mps2/interrupts.h"
#include "port/mps2/link.h"
#include "port/semihost/semihost.h"

static struct {
    struct exchange_message out; /* gathers what is sent between two exchanges */
    struct exchange_message in;
    int out_handle;
    int in_handle;
    bool fast;
    volatile bool stop;
    volatile bool failed;
} self;

/* The gateway opens them in the same order; each open waits for the other end. */
static int begin(const struct command_line *line)
{
    self.fast = line->fast;
    self.out_handle = semihost_open(line->out, SEMIHOST_WRITE);
    self.in_handle = self.out_handle >= 0 ? semihost_open(line->in, SEMIHOST_READ) : -1;
    return self.in_handle >= 0 ? 0 : PORT_ERR_SYSTEM;
}

/* A reply may come in several pieces. */
static bool read_reply(void)
{
    size_t got = 0;
    while (got < sizeof self.in.header || got < exchange_size(&self.in)) {
        const int more =
            semihost_read_some(self.in_handle, (uint8_t *)&self.in + got, sizeof self.in - got);
        if (more <= 0) {
            return false;
        }
        got += (size_t)more;
        if (got >= sizeof self.in.header && self.in.header.count > EXCHANGE_FRAMES) {
            return false;
        }
    }
    return true;
}

static void receive_frames(void)
{
    for (uint32_t i = 0; i < self.in.header.count; ++i) {
        struct can_msg message;
        exchange_unpack(&message, &self.in.frames[i]);
        interrupts_receive(&message);
    }
}

/* One request and its reply, whose frames are received. Without a gateway nothing is exchanged. */
static void exchange(uint16_t flags, uint32_t guard_us)
{
    self.out.header.flags = flags;
    self.out.header.period_us = systick_period_us();
    self.out.header.guard_us = guard_us;
    if (self.failed || semihost_write(self.out_handle, &self.out, exchange_size(&self.out)) != 0 ||
        !read_reply()) {
        self.failed = true;
        self.in.header = (struct exchange_header){.flags = EXCHANGE_DUE | EXCHANGE_STOP};
    }
    self.out.header.count = 0;
    if ((self.in.header.flags & EXCHANGE_STOP) != 0u && !self.stop) {
        self.stop = true;
        port_wake();
    }
    receive_frames();
}

static int accept(const struct can_match *filters, size_t count)
{
    for (size_t i = 0; i < count && i < EXCHANGE_FRAMES; ++i) {
        self.out.frames[i] = (struct exchange_frame){
            .id = filters[i].id,
            .data = {(uint8_t)(filters[i].mask & 0xFFu), (uint8_t)(filters[i].mask >> 8)}};
    }
    self.out.header.count = (uint16_t)count;
    exchange(EXCHANGE_FILTER, 0);
    return self.failed ? PORT_ERR_SYSTEM : 0;
}

static int send(const struct can_msg *message)
{
    int result = PORT_ERR_FULL;
    const uint32_t before = core_mask();
    if (self.out.header.count < EXCHANGE_FRAMES && !self.failed) {
        struct exchange_frame *frame = &self.out.frames[self.out.header.count++];
        exchange_pack(frame, message);
        frame->of_tick = interrupts_in_tick() ? 1u : 0u;
        result = 0;
    }
    core_unmask(before);
    return result;
}

static bool delivered(void)
{
    return (self.in.header.flags & EXCHANGE_WAITING) == 0u;
}

static uint16_t tick_flags(const struct link_request *request)
{
    const unsigned await = request->awaiting ? EXCHANGE_AWAIT : 0u;
    const unsigned hurry = request->awaiting && request->hurry && self.fast ? EXCHANGE_HURRY : 0u;
    return (uint16_t)(EXCHANGE_TICK | await | hurry);
}

/* Exchanges until the next tick is due. At lock step that is when all have answered, and no tick is late. */
static uint32_t after_tick(const struct link_request *request)
{
    const uint16_t flags = tick_flags(request);
    exchange(flags, request->guard_us);
    while ((self.in.header.flags & EXCHANGE_DUE) == 0u) {
        if (request->awaiting) {
            exchange(EXCHANGE_AWAIT, 0);
        } else if ((flags & EXCHANGE_HURRY) != 0u) {
            return 0;
        } else {
            exchange(EXCHANGE_READY, 0);
        }
    }
    return self.fast ? 0u : self.in.header.late_ns;
}

static void end(void)
{
    exchange(EXCHANGE_END, 0);
}

static bool stop_requested(void)
{
    return self.stop;
}

static bool failed(void)
{
    return self.failed;
}

const struct link link_fifo = {
    .sleeps = false,
    .begin = begin,
    .accept = accept,
    .send = send,
    .delivered = delivered,
    .after_tick = after_tick,
    .end = end,
    .stop_requested = stop_requested,
    .failed = failed,
};
