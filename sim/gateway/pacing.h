/* SPDX-License-Identifier: MIT */
/*
 * pacing: decides when the gateway replies to a request of the emulated board, so that the ticks of the board come at
 * the same times as those of the Linux port (port/linux/schedule.h). Used by gateway/fifo_side. Pure arithmetic on
 * monotonic nanoseconds.
 *
 * The clock of the board is stopped while it waits for the reply to the request of a tick. So the next tick is due with
 * the reply.
 */
#ifndef GATEWAY_PACING_H
#define GATEWAY_PACING_H

#include <stdbool.h>
#include <stdint.h>

#include "port/linux/schedule.h"
#include "port/mps2/exchange.h"

/* All zero is the beginning. */
struct pacing {
    struct schedule schedule;
    bool begun;    /* there has been a tick */
    bool started;  /* a reply has reported that the next tick is due */
    bool at_once;  /* the reply is due at once: a request that belongs to no tick */
    bool awaiting; /* frames end the wait as well */
};

/* A request of the board. */
void pacing_request(struct pacing *pacing, const struct exchange_header *request, uint64_t now_ns);

/* How long to wait for a frame at most, then call pacing_over(). 0: do not wait. */
uint64_t pacing_wait_ns(const struct pacing *pacing, uint64_t now_ns);

/* True when it is time to reply, with the `frames` that have come: fills in the other fields of the reply's header. */
bool pacing_over(struct pacing *pacing, uint32_t frames, uint64_t now_ns,
                 struct exchange_header *reply);

#endif
