/* SPDX-License-Identifier: MIT */
/* Implements injector/outbox.h (see there): frames to one bus that are sent together. Used by injector/main. One thread
 * for each box. Sends frames, and changes its box. */
#define _GNU_SOURCE
#include "injector/outbox.h"

#include <errno.h>
#include <poll.h>

enum { SEND_TRIES = 200 };

int outbox_flush(struct outbox *box, struct can_socket *socket)
{
    size_t done = 0;
    int failed = 0;
    for (int tries = 0; failed == 0 && done < box->count && tries < SEND_TRIES;) {
        const int sent = can_socket_send_many(socket, box->frames + done, box->count - done);
        if (sent > 0) {
            done += (size_t)sent;
        } else if (sent == -EAGAIN) {
            struct pollfd writable = {.fd = socket->fd, .events = POLLOUT};
            (void)poll(&writable, 1, 1);
            tries++;
        } else {
            failed = sent;
        }
    }
    box->count = 0;
    return failed;
}

int outbox_put(struct outbox *box, struct can_socket *socket, const struct can_msg *frame)
{
    box->frames[box->count++] = *frame;
    return box->count == CAN_SOCKET_BATCH ? outbox_flush(box, socket) : 0;
}
