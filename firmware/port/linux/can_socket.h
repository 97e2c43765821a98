/* SPDX-License-Identifier: MIT */
/*
 * can_socket: classic CAN frames through a raw SocketCAN socket, or through a local bus without kernel CAN. Used by
 * port/linux and sim/. Opens a socket, sends and receives on it. One thread at a time for each socket, except that
 * can_socket_send may be called by a second one.
 *
 * The socket never blocks in real time. In virtual time sending waits until the hub takes the frame. Received remote,
 * extended and error frames are dropped. A socket does not receive its own frames; other sockets of the same machine
 * receive them.
 *
 * Tracking shows whether frames have been sent on the bus, not only queued. SocketCAN gives a frame back when the CAN
 * controller has sent it (vcan, and drivers that do not support this, when it is queued). A local bus in virtual time
 * gives it back at its last bit. On a local bus in real time, which has no bit times, nothing ever waits.
 */
#ifndef PORT_LINUX_CAN_SOCKET_H
#define PORT_LINUX_CAN_SOCKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "can/can_match.h"

#define CAN_SOCKET_FILTERS 40u
#define CAN_SOCKET_BATCH   32u
#define CAN_SOCKET_TRACKED 16u /* identifiers, and frames at a time */

struct can_socket {
    int fd; /* for poll(); -1 when closed */
    /* On a local bus the Linux kernel cannot filter: filters are applied here, and by the hub in virtual time. */
    struct can_match filters[CAN_SOCKET_FILTERS];
    size_t filter_count;
    bool local;
    uint16_t tracked[CAN_SOCKET_TRACKED]; /* identifiers that have been tracked */
    size_t tracked_count;
    uint16_t waiting[CAN_SOCKET_TRACKED]; /* of the tracked frames that have not come back */
    size_t waiting_count;
    uint64_t
        stamps_ns[CAN_SOCKET_BATCH]; /* virtual time: when the frames of the last receive came */
};

/* Opens and binds: a network interface, or with a '/' in its name the local bus of hodograph-hub (sim/hub) at this
 * path. Returns 0, or a negative errno with one line in `reason`: the error and its remedy. */
int can_socket_open(struct can_socket *socket, const char *interface, char *reason, size_t size);
void can_socket_close(struct can_socket *socket);

/* Lets only these frames through (none: all). At most CAN_SOCKET_FILTERS. 0 or negative errno. */
int can_socket_filter(struct can_socket *socket, const struct can_match *filters, size_t count);

/* Virtual time: these frames do not wake the process, which takes them when it wakes for something else. At most
 * CAN_SOCKET_FILTERS. Without effect elsewhere. 0 or negative errno. */
int can_socket_defer(struct can_socket *socket, const struct can_match *frames, size_t count);

/* 0; -EAGAIN when the queue is full (the frame is not sent); else a negative errno (interface down,
 * removed). */
int can_socket_send(struct can_socket *socket, const struct can_msg *message);

/* Tracks the next frame with this identifier; call it before the frame is sent. 0; -ENOSPC when too many are tracked,
 * or another negative errno: then it is not tracked. */
int can_socket_track(struct can_socket *socket, uint16_t id);

/* The frame was not sent after all. */
void can_socket_untrack(struct can_socket *socket, uint16_t id);

/* How many tracked frames still wait for the bus, as far as can_socket_receive has seen. */
size_t can_socket_waiting(const struct can_socket *socket);

/* Forgets the frames that wait: a CAN controller that goes bus-off drops its frames without a report. */
void can_socket_forget(struct can_socket *socket);

/* Sends up to CAN_SOCKET_BATCH frames in one system call. Returns how many were sent, from the first on; -EAGAIN if
 * none (queue full); else a negative errno. */
int can_socket_send_many(struct can_socket *socket, const struct can_msg *messages, size_t count);

/* Takes up to CAN_SOCKET_BATCH waiting frames, oldest first. Returns how many are in `messages`, and sets *more if
 * others may wait; or a negative errno (interface down, removed). */
int can_socket_receive(struct can_socket *socket, struct can_msg messages[CAN_SOCKET_BATCH],
                       int *more);

/* Bytes that the Linux kernel keeps for this socket, with its own overhead; 0 if it does not report them. For frames
 * that come in packets: about what it would keep if each came by itself. */
uint32_t can_socket_waiting_bytes(const struct can_socket *socket);

#endif
