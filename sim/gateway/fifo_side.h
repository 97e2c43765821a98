/* SPDX-License-Identifier: MIT */
/* fifo_side: serves the requests of an emulated board on two FIFOs (port/mps2/exchange.h). Called by main of the
 * gateway. */
#ifndef GATEWAY_FIFO_SIDE_H
#define GATEWAY_FIFO_SIDE_H

#include "gateway/bus.h"
#include "port/linux/can_socket.h"

/* Until the board ends or is gone. Returns an exit status; unless 0, a line on stderr has the reason. */
int fifo_side_run(struct can_socket *socket, const char *out, const char *in);

/* How serving has ended; unless GATEWAY_OK with two texts: what has failed, and why. */
struct fifo_side_end {
    enum gateway_status status;
    const char *what;
    const char *why;
};

/* The same on open descriptors, as the board sees them: requests come from `out`, replies go to `in`. A request that is
 * not complete or has more than EXCHANGE_FRAMES frames means that the board is gone; one with a frame that is none, or
 * with too many filters, is an error of the bus (EINVAL). */
struct fifo_side_end fifo_side_serve(struct can_socket *socket, int out, int in);

#endif
