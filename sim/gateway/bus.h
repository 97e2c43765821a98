/* SPDX-License-Identifier: MIT */
/* bus: the CAN side of the bridge, and its wish to end. */
#ifndef GATEWAY_BUS_H
#define GATEWAY_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "port/linux/can_socket.h"

enum bridge_status { BRIDGE_OK = 0, BRIDGE_GONE = 1, BRIDGE_USAGE = 2, BRIDGE_BUS = 4 };

/* SIGTERM and SIGINT from now on only say so here. */
int bus_catch_signals(void);
unsigned bus_signals(void); /* how many have come */

/* They come at any time, while the board is waited for as well: clock_join() puts them off. */
void bus_heed_signals(void);

/* Sends all of them; waits while the queue of the interface is full. Returns 0, or a negative errno. */
int bus_send(struct can_socket *socket, const struct can_msg *messages, size_t count);

/* One line on stderr. Returns `status`. */
int bus_complain(int status, const char *what, const char *why);

#endif
