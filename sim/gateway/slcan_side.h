/* SPDX-License-Identifier: MIT */
/* slcan_side: a stream of SLCAN lines (can/slcan.h) on a socket. */
#ifndef GATEWAY_SLCAN_SIDE_H
#define GATEWAY_SLCAN_SIDE_H

#include "port/linux/can_socket.h"

/* `address`: a UNIX socket's path, HOST:PORT, or fd:N, a connected socket of the caller's; if one of datagrams, these may
 * be cut anywhere. Until the board has closed after a signal, a second signal, or the end of the stream. Returns an exit
 * status; unless 0, a line on stderr has the reason. */
int slcan_side_run(struct can_socket *socket, const char *address);

#endif
