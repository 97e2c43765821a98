/* SPDX-License-Identifier: MIT */
/* Implements port/linux/can_socket.h (see there): classic CAN frames through a raw SocketCAN socket, or through a local
 * bus without kernel CAN. Used by port/linux and sim/. One thread at a time for each socket, except that
 * can_socket_send may be called by a second one. Changes its socket, and in virtual time the clock of the process
 * (clock_note_sent). */
#define _GNU_SOURCE
#include "port/linux/can_socket.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/sock_diag.h>

#include "port/linux/clock.h"
#include "port/linux/local_bus.h"

void can_socket_close(struct can_socket *socket)
{
    if (socket->fd >= 0) {
        (void)close(socket->fd);
        socket->fd = -1;
    }
}

/* Filters for the hub and for the Linux kernel: identifiers of the base format, no remote frames. */
static void raw_filters(struct can_filter *raw, const struct can_match *filters, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        raw[i].can_id = filters[i].id;
        raw[i].can_mask = (canid_t)(filters[i].mask | CAN_EFF_FLAG | CAN_RTR_FLAG);
    }
}

static int tell_hub(const struct can_socket *socket, uint16_t kind, const struct can_match *filters,
                    size_t count)
{
    struct local_bus_filters message = {
        .mark = LOCAL_BUS_MARK, .kind = kind, .count = (uint16_t)count};
    const size_t size =
        offsetof(struct local_bus_filters, filters) + count * sizeof message.filters[0];
    raw_filters(message.filters, filters, count);
    clock_note_sent();
    return send(socket->fd, &message, size, MSG_NOSIGNAL) == (ssize_t)size ? 0 : -errno;
}

/* Own frames that are tracked also pass the filters. Without filters all frames pass. */
static int set_kernel_filters(const struct can_socket *socket)
{
    struct can_filter raw[CAN_SOCKET_FILTERS + CAN_SOCKET_TRACKED];
    size_t count = socket->filter_count;
    raw_filters(raw, socket->filters, count);
    for (size_t i = 0; i < socket->tracked_count && socket->filter_count > 0u; ++i) {
        const struct can_match own = {socket->tracked[i], CAN_ID_MAX};
        raw_filters(&raw[count++], &own, 1);
    }
    if (count == 0u) {
        return 0;
    }
    const socklen_t bytes = (socklen_t)(count * sizeof raw[0]);
    return setsockopt(socket->fd, SOL_CAN_RAW, CAN_RAW_FILTER, raw, bytes) == 0 ? 0 : -errno;
}

/* Filters here at once, and soon at the hub, which then wakes no process for other frames. */
int can_socket_filter(struct can_socket *socket, const struct can_match *filters, size_t count)
{
    if (count > CAN_SOCKET_FILTERS) {
        return -EINVAL;
    }
    memcpy(socket->filters, filters, count * sizeof filters[0]);
    socket->filter_count = count;
    return socket->local ? tell_hub(socket, LOCAL_BUS_FILTER, filters, count)
                         : set_kernel_filters(socket);
}

int can_socket_defer(struct can_socket *socket, const struct can_match *frames, size_t count)
{
    if (count > CAN_SOCKET_FILTERS) {
        return -EINVAL;
    }
    return socket->local && clock_is_virtual() ? tell_hub(socket, LOCAL_BUS_DEFER, frames, count)
                                               : 0;
}

static int ask_back(const struct can_socket *socket)
{
    const int on = 1;
    if (socket->local) {
        struct can_match ids[CAN_SOCKET_TRACKED];
        for (size_t i = 0; i < socket->tracked_count; ++i) {
            ids[i] = (struct can_match){socket->tracked[i], CAN_ID_MAX};
        }
        return tell_hub(socket, LOCAL_BUS_TRACK, ids, socket->tracked_count);
    }
    const int error =
        setsockopt(socket->fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &on, sizeof on) == 0 ? 0
                                                                                        : -errno;
    return error == 0 ? set_kernel_filters(socket) : error;
}

static bool is_among(const uint16_t *ids, size_t count, uint16_t id)
{
    size_t i = 0;
    while (i < count && ids[i] != id) {
        ++i;
    }
    return i < count;
}

int can_socket_track(struct can_socket *socket, uint16_t id)
{
    if (socket->local && !clock_is_virtual()) {
        return 0;
    }
    if (!is_among(socket->tracked, socket->tracked_count, id)) {
        if (socket->tracked_count == CAN_SOCKET_TRACKED) {
            return -ENOSPC;
        }
        socket->tracked[socket->tracked_count++] = id;
        const int error = ask_back(socket);
        if (error != 0) {
            socket->tracked_count--;
            return error;
        }
    }
    if (socket->waiting_count == CAN_SOCKET_TRACKED) {
        return -ENOSPC;
    }
    socket->waiting[socket->waiting_count++] = id;
    return 0;
}

void can_socket_untrack(struct can_socket *socket, uint16_t id)
{
    for (size_t i = 0; i < socket->waiting_count; ++i) {
        if (socket->waiting[i] == id) {
            socket->waiting[i] = socket->waiting[--socket->waiting_count];
            return;
        }
    }
}

size_t can_socket_waiting(const struct can_socket *socket)
{
    return socket->waiting_count;
}

void can_socket_forget(struct can_socket *socket)
{
    socket->waiting_count = 0;
}

static struct can_frame raw_frame(const struct can_msg *message)
{
    struct can_frame frame;
    memset(&frame, 0, sizeof frame);
    frame.can_id = message->id;
    frame.can_dlc = message->len;
    memcpy(frame.data, message->data, sizeof frame.data);
    return frame;
}

/* In virtual time the hub takes every frame: waits for it. */
static bool await_room(const struct can_socket *socket)
{
    struct pollfd writable = {.fd = socket->fd, .events = POLLOUT};
    return socket->local && clock_is_virtual() && errno == EAGAIN && poll(&writable, 1, -1) >= 0;
}

int can_socket_send_many(struct can_socket *socket, const struct can_msg *messages, size_t count)
{
    struct can_frame frames[CAN_SOCKET_BATCH];
    struct iovec vectors[CAN_SOCKET_BATCH];
    struct mmsghdr headers[CAN_SOCKET_BATCH];
    count = count < CAN_SOCKET_BATCH ? count : CAN_SOCKET_BATCH;
    memset(headers, 0, sizeof headers);
    for (size_t i = 0; i < count; ++i) {
        frames[i] = raw_frame(&messages[i]);
        vectors[i].iov_base = &frames[i];
        vectors[i].iov_len = sizeof frames[i];
        headers[i].msg_hdr.msg_iov = &vectors[i];
        headers[i].msg_hdr.msg_iovlen = 1;
    }
    int sent = 0;
    clock_note_sent();
    do {
        sent = sendmmsg(socket->fd, headers, (unsigned)count, MSG_DONTWAIT);
    } while (sent < 0 && await_room(socket));
    if (sent < 0) {
        return errno == ENOBUFS || errno == EINTR ? -EAGAIN : -errno;
    }
    return sent;
}

int can_socket_send(struct can_socket *socket, const struct can_msg *message)
{
    const struct can_frame frame = raw_frame(message);
    clock_note_sent();
    do {
        if (write(socket->fd, &frame, sizeof frame) == (ssize_t)sizeof frame) {
            return 0;
        }
    } while (await_room(socket));
    return errno == ENOBUFS ? -EAGAIN : -errno;
}

static bool plain_frame(const struct can_frame *frame)
{
    return (frame->can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) == 0 &&
           frame->can_dlc <= CAN_MAX_DLEN;
}

static bool passes(const struct can_socket *socket, const struct can_msg *message)
{
    return socket->filter_count == 0u ||
           can_match_any(socket->filters, socket->filter_count, message);
}

static void convert(struct can_msg *message, const struct can_frame *frame)
{
    memset(message, 0, sizeof *message);
    message->id = frame->can_id & CAN_SFF_MASK;
    message->len = frame->can_dlc;
    memcpy(message->data, frame->data, frame->can_dlc);
}

/* Whether it is one that this socket has sent. */
static bool is_own(const struct can_socket *socket, const struct mmsghdr *header,
                   const struct local_bus_frame *frame)
{
    return socket->local ? (frame->frame.__res0 & LOCAL_BUS_OWN) != 0u
                         : (header->msg_hdr.msg_flags & MSG_CONFIRM) != 0;
}

static size_t frame_bytes(const struct can_socket *socket)
{
    return socket->local ? sizeof(struct local_bus_frame) : sizeof(struct can_frame);
}

/* Only a hub in virtual time puts several frames into a packet. */
static size_t frames_in_packet(const struct can_socket *socket)
{
    return socket->local && clock_is_virtual() ? LOCAL_BUS_PACKET : 1u;
}

/* Sorts the frames of a packet: those that pass the filters go to `messages`, own tracked ones are noted as sent.
 * Returns how many are in `messages`. */
static int sort_out(struct can_socket *socket, const struct mmsghdr *header,
                    const struct local_bus_frame *frames, struct can_msg *messages,
                    uint64_t *stamps_ns)
{
    const size_t size = frame_bytes(socket);
    int count = 0;
    for (size_t i = 0; i < header->msg_len / size && header->msg_len % size == 0u; ++i) {
        if (!plain_frame(&frames[i].frame)) {
            continue;
        }
        convert(&messages[count], &frames[i].frame);
        stamps_ns[count] = socket->local ? frames[i].time_ns : 0u;
        if (is_own(socket, header, &frames[i])) {
            can_socket_untrack(socket, (uint16_t)messages[count].id);
        } else {
            count += passes(socket, &messages[count]) ? 1 : 0;
        }
    }
    return count;
}

/* A local bus ends with an empty message; the frames before it are still returned. */
static bool at_end(const struct mmsghdr *headers, int got)
{
    return got > 0 && headers[got - 1].msg_len == 0u;
}

int can_socket_receive(struct can_socket *socket, struct can_msg messages[CAN_SOCKET_BATCH],
                       int *more)
{
    struct local_bus_frame frames[CAN_SOCKET_BATCH];
    struct iovec vectors[CAN_SOCKET_BATCH];
    struct mmsghdr headers[CAN_SOCKET_BATCH];
    const size_t each = frames_in_packet(socket);
    const size_t packets = CAN_SOCKET_BATCH / each;
    memset(headers, 0, packets * sizeof headers[0]);
    for (size_t i = 0; i < packets; ++i) {
        vectors[i].iov_base = &frames[i * each];
        vectors[i].iov_len = each * frame_bytes(socket);
        headers[i].msg_hdr.msg_iov = &vectors[i];
        headers[i].msg_hdr.msg_iovlen = 1;
    }
    *more = 0;
    const int got = recvmmsg(socket->fd, headers, (unsigned)packets, MSG_DONTWAIT, NULL);
    if (got < 0) {
        return errno == EAGAIN || errno == EINTR ? 0 : -errno;
    }
    int count = 0;
    for (int i = 0; i < got; ++i) {
        count += sort_out(socket, &headers[i], &frames[(size_t)i * each], messages + count,
                          socket->stamps_ns + count);
    }
    *more = got == (int)packets;
    return count == 0 && socket->local && at_end(headers, got) ? -ENETDOWN : count;
}

uint32_t can_socket_waiting_bytes(const struct can_socket *socket)
{
    uint32_t memory[SK_MEMINFO_VARS];
    socklen_t size = sizeof memory;
    if (getsockopt(socket->fd, SOL_SOCKET, SO_MEMINFO, memory, &size) != 0) {
        return 0;
    }
    return memory[SK_MEMINFO_RMEM_ALLOC] * (uint32_t)frames_in_packet(socket);
}
