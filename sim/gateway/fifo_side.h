/* SPDX-License-Identifier: MIT */
/* fifo_side: serves the requests of an emulated board on two FIFOs (port/mps2/exchange.h). Called by gateway/main. One
 * thread, once: its state is static. Opens and reads the FIFOs, sends and receives frames, and writes errors to stderr.
 * */
#ifndef GATEWAY_FIFO_SIDE_H
#define GATEWAY_FIFO_SIDE_H

#include "gateway/bus.h"
#include "port/linux/can_socket.h"

/* Runs until the board ends or disappears. Returns an exit status; unless 0, a line on stderr has the reason. */
int fifo_side_run(struct can_socket *socket, const char *out, const char *in);

/* How serving has ended; unless GATEWAY_OK with two texts: the failed operation, and the reason. */
struct fifo_side_end {
    enum gateway_status status;
    const char *what;
    const char *why;
};

/* The same on open descriptors, named from the side of the board: requests come from `out`, replies go to `in`. An
 * incomplete request, or one with more than EXCHANGE_FRAMES frames, means that the board has ended. An invalid frame or
 * too many filters are an error of the bus (EINVAL). */
struct fifo_side_end fifo_side_serve(struct can_socket *socket, int out, int in);

#endif
