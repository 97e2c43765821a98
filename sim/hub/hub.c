/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "hub/hub.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <linux/can.h>

enum { BATCH = 32, BUFFER_BYTES = 4 * 1024 * 1024 };

struct batch {
    struct can_frame frames[BATCH];
    struct iovec vectors[BATCH];
    struct mmsghdr headers[BATCH];
};

int hub_open(struct hub *hub, const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    memset(hub, 0, sizeof *hub);
    if (strlen(path) >= sizeof address.sun_path) {
        return -ENAMETOOLONG;
    }
    memcpy(address.sun_path, path, strlen(path) + 1u);
    hub->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (hub->listener >= 0 &&
        bind(hub->listener, (const struct sockaddr *)&address, sizeof address) == 0 &&
        listen(hub->listener, (int)HUB_MEMBERS) == 0) {
        return 0;
    }
    return -errno;
}

static void take_member(struct hub *hub)
{
    const int bytes = BUFFER_BYTES;
    const int fd = accept4(hub->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) {
        return;
    }
    if (hub->count == HUB_MEMBERS) {
        (void)close(fd);
        return;
    }
    if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    }
    hub->members[hub->count++] = fd;
}

static void drop_member(struct hub *hub, size_t index)
{
    (void)close(hub->members[index]);
    hub->members[index] = hub->members[--hub->count];
}

/* Frames that lie in the socket; 0: the member has gone, or there is none. */
static size_t receive(int fd, struct batch *batch, bool *gone)
{
    memset(batch->headers, 0, sizeof batch->headers);
    for (size_t i = 0; i < BATCH; ++i) {
        batch->vectors[i] = (struct iovec){&batch->frames[i], sizeof batch->frames[i]};
        batch->headers[i].msg_hdr.msg_iov = &batch->vectors[i];
        batch->headers[i].msg_hdr.msg_iovlen = 1;
    }
    const int got = recvmmsg(fd, batch->headers, BATCH, MSG_DONTWAIT, NULL);
    size_t count = 0;
    while (got > 0 && count < (size_t)got &&
           batch->headers[count].msg_len == sizeof batch->frames[0]) {
        ++count;
    }
    *gone = got < 0 ? errno != EAGAIN && errno != EINTR : count < (size_t)got;
    return count;
}

static void send_to(struct hub *hub, int fd, struct batch *batch, size_t count)
{
    const int sent = sendmmsg(fd, batch->headers, (unsigned)count, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent >= 0 || errno == EAGAIN) { /* else it has left, and is dropped in its turn */
        hub->lost += count - (size_t)(sent > 0 ? sent : 0);
    }
}

/* False: the member has gone. */
static bool pass_on(struct hub *hub, size_t from)
{
    static struct batch batch;
    bool gone = false;
    const size_t count = receive(hub->members[from], &batch, &gone);
    for (size_t i = 0; i < hub->count && count > 0u; ++i) {
        if (i != from) {
            send_to(hub, hub->members[i], &batch, count);
        }
    }
    return !gone;
}

bool hub_turn(struct hub *hub, int end)
{
    struct pollfd wait[HUB_MEMBERS + 2u] = {{.fd = end, .events = POLLIN},
                                            {.fd = hub->listener, .events = POLLIN}};
    for (size_t i = 0; i < hub->count; ++i) {
        wait[i + 2u] = (struct pollfd){.fd = hub->members[i], .events = POLLIN};
    }
    if (poll(wait, hub->count + 2u, -1) < 0) {
        return errno == EINTR;
    }
    /* From the last: who leaves changes places with one that has had its turn. */
    for (size_t i = hub->count; i-- > 0u;) {
        if (wait[i + 2u].revents != 0 && !pass_on(hub, i)) {
            drop_member(hub, i);
        }
    }
    if (wait[1].revents != 0) {
        take_member(hub);
    }
    return wait[0].revents == 0;
}

void hub_close(struct hub *hub)
{
    while (hub->count > 0u) {
        drop_member(hub, hub->count - 1u);
    }
    (void)close(hub->listener);
}
