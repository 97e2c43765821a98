/* SPDX-License-Identifier: MIT */
/* slcan_side: forwards frames between a CAN bus and a stream of SLCAN lines (can/slcan.h), which an emulated board
 * reads and writes. Called by gateway/main (hodograph-bridge --slcan). One thread. Opens a connection to the board,
 * sends and receives frames, and writes errors to stderr. */
#ifndef GATEWAY_SLCAN_SIDE_H
#define GATEWAY_SLCAN_SIDE_H

#include "port/linux/can_socket.h"

/* Runs until the stream ends, the board has closed after a signal, or a second signal comes. `address`: path of a UNIX
 * socket, HOST:PORT, or fd:N for a connected socket of the caller. Datagrams may be cut anywhere. Returns an exit
 * status; if it is not 0, a line on stderr has the reason. */
int slcan_side_run(struct can_socket *socket, const char *address);

#endif
