/* SPDX-License-Identifier: MIT */
/* outbox: frames to one bus that leave together: a call of the system for each costs more than all the rest.
 *
 * A full queue of the interface empties within a few frame times: it is waited for. One that stays full is a bus that is
 * off: the frames are lost.
 */
#ifndef INJECTOR_OUTBOX_H
#define INJECTOR_OUTBOX_H

#include "can/can_frame.h"
#include "port/linux/can_socket.h"

struct outbox {
    struct can_msg frames[CAN_SOCKET_BATCH];
    size_t count;
};

/* Keeps a frame for outbox_flush; a full box is flushed. Both return 0 or the negative errno of a bus that failed. */
int outbox_put(struct outbox *box, struct can_socket *socket, const struct can_msg *frame);
int outbox_flush(struct outbox *box, struct can_socket *socket);

#endif
