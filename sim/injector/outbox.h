/* SPDX-License-Identifier: MIT */
/* outbox: collects the frames for one bus and sends them together, because a system call for each frame would take most
 * of the injector's time. Used by injector/main. Sends frames, and changes its box.
 *
 * If the queue of the interface is full, outbox_flush waits for a few frame times. If it stays full, the bus is off,
 * and the frames are lost. One thread for each box.
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
