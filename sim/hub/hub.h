/* SPDX-License-Identifier: MIT */
/*
 * hub: a CAN bus without bits, without a kernel's CAN: each frame that one of its members sends goes to all others, in one order.
 *
 * A member is a connection of type SOCK_SEQPACKET; a message is one struct can_frame of linux/can.h. So whoever can use a raw
 * CAN socket can be a member (port/linux/can_socket.h). A member that does not take its frames loses those for which its buffer of
 * some megabytes has no room; nobody waits for it.
 */
#ifndef HUB_HUB_H
#define HUB_HUB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define HUB_MEMBERS 32u

struct hub {
    int listener;
    int members[HUB_MEMBERS];
    size_t count;
    uint64_t lost; /* frames that found no room */
};

/* Serves the bus at `path`, which is made and must not be there. 0 or a negative errno. */
int hub_open(struct hub *hub, const char *path);

/* Waits for something to happen and does it. False: `end` has become readable, or nothing can happen any more. */
bool hub_turn(struct hub *hub, int end);

/* Ends the bus for all its members. */
void hub_close(struct hub *hub);

#endif
