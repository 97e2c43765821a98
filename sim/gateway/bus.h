/* SPDX-License-Identifier: MIT */
/* bus: sends frames of the gateway to CAN, counts the signals that end the process, and prints error messages. Used by
 * gateway/main, gateway/fifo_side and gateway/slcan_side. One thread. Sends to the CAN socket, sets signal handlers and
 * the signal mask of the process, and writes to stderr. */
#ifndef GATEWAY_BUS_H
#define GATEWAY_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "port/linux/can_socket.h"

/* Exit statuses of hodograph-bridge. */
enum gateway_status {
    GATEWAY_OK = 0,    /* the board has ended, by itself or after a signal */
    GATEWAY_GONE = 1,  /* the board or its connection is gone */
    GATEWAY_USAGE = 2, /* wrong command line */
    GATEWAY_BUS = 4    /* the bus cannot be opened, or has failed */
};

/* From now on SIGTERM, SIGINT and, if it is not ignored, SIGHUP of this process are only counted. 0, or -1 with errno
 * set. */
int bus_catch_signals(void);
unsigned bus_signals(void); /* how many have come */

/* Unblocks the signals that clock_join() has blocked, so that they arrive also while the gateway waits for the board.
 * */
void bus_unblock_signals(void);

/* Sends all of them; waits while the queue of the interface is full. Returns 0, or a negative errno. */
int bus_send(struct can_socket *socket, const struct can_msg *messages, size_t count);

/* One line on stderr. Returns `status`. */
int bus_complain(int status, const char *what, const char *why);

#endif
