/* SPDX-License-Identifier: MIT */
/* link_slcan of port/mps2/link.h: SLCAN on the UART, in real time. The board acts as a host of an adapter: it opens the
 * bus. Used by port/mps2 only. Main loop and interrupts, as struct link states. Sends and receives characters by
 * uart.c. */
#include "can/slcan.h"
#include "port/cortex_m/core.h"
#include "port/mps2/interrupts.h"
#include "port/mps2/link.h"
#include "port/mps2/uart.h"

static struct {
    struct slcan_decoder decoder;
    struct can_match filters[PORT_FILTERS];
    size_t filter_count;
    uint32_t mark; /* after the last frame of a tick */
    volatile bool stop;
} self;

static void take(char character)
{
    struct can_msg message;
    if (slcan_decode(&self.decoder, character, &message) &&
        can_match_any(self.filters, self.filter_count, &message)) {
        interrupts_receive(&message);
    }
    if (self.decoder.closed && !self.stop) {
        self.stop = true;
        port_wake();
    }
}

/* An adapter may still be open from an earlier run. */
static int begin(const struct command_line *line)
{
    static const char open[] = "C\rS8\rO\r";
    (void)line;
    uart_begin(take);
    (void)uart_send(open, sizeof open - 1u);
    return 0;
}

static int accept(const struct can_match *filters, size_t count)
{
    const uint32_t before = core_mask();
    for (size_t i = 0; i < count; ++i) {
        self.filters[i] = filters[i];
    }
    self.filter_count = count;
    core_unmask(before);
    return 0;
}

static int send(const struct can_msg *message)
{
    char line[SLCAN_LINE_MAX];
    const bool sent = uart_send(line, slcan_encode(message, line));
    if (sent && interrupts_in_tick()) {
        self.mark = uart_mark();
    }
    return sent ? 0 : PORT_ERR_FULL;
}

/* Delivered to the adapter: whether frames wait there is not known. */
static bool delivered(void)
{
    return uart_passed(self.mark);
}

/* Only the clock decides when the next tick is due. */
static uint32_t after_tick(const struct link_request *request)
{
    (void)request;
    return 0;
}

static void end(void)
{
    static const char close[] = "C\r";
    (void)uart_send(close, sizeof close - 1u);
    while (!uart_idle()) {
    }
}

static bool stop_requested(void)
{
    return self.stop;
}

/* A UART cannot detect whether the other end has failed. */
static bool failed(void)
{
    return false;
}

const struct link link_slcan = {
    .sleeps = true,
    .begin = begin,
    .accept = accept,
    .send = send,
    .delivered = delivered,
    .after_tick = after_tick,
    .end = end,
    .stop_requested = stop_requested,
    .failed = failed,
};
