/* SPDX-License-Identifier: MIT */
/* fifo_side: serves the requests of an emulated board on two FIFOs (port/mps2/exchange.h). */
#ifndef GATEWAY_FIFO_SIDE_H
#define GATEWAY_FIFO_SIDE_H

#include "port/linux/can_socket.h"

/* Until the board ends or is gone. Returns an exit status; unless 0, a line on stderr has said why. */
int fifo_side_run(struct can_socket *socket, const char *out, const char *in);

#endif
