/* SPDX-License-Identifier: MIT */
/* Implements port/linux/local_connection.h (see there): opening a connection to the hub of a local bus (local_bus.h).
 * Used by can_socket_open and clock. Any thread; local_connection_open waits for the welcome of the hub. Opens a
 * socket, sends a message and receives one. */
#define _GNU_SOURCE
#include "port/linux/local_connection.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define BUFFER_BYTES (4 * 1024 * 1024)

enum { WELCOME_MS = 60000 };

bool local_connection_named(const char *bus)
{
    return strchr(bus, '/') != NULL;
}

/* The buffer must hold all that is sent while the process sleeps for some milliseconds. */
static void enlarge_buffer(int fd)
{
    const int bytes = BUFFER_BYTES;
    if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    }
}

static int await_welcome(int fd, struct local_bus_control *welcome)
{
    struct pollfd wait = {.fd = fd, .events = POLLIN};
    int ready = 0;
    do {
        ready = poll(&wait, 1, WELCOME_MS);
    } while (ready < 0 && errno == EINTR);
    if (ready <= 0) {
        return ready == 0 ? -ETIMEDOUT : -errno;
    }
    const ssize_t size = recv(fd, welcome, sizeof *welcome, 0);
    const bool understood = size == (ssize_t)sizeof *welcome && welcome->mark == LOCAL_BUS_MARK &&
                            welcome->version == LOCAL_BUS_VERSION &&
                            welcome->kind == LOCAL_BUS_WELCOME;
    return understood ? 0 : -EPROTO;
}

int local_connection_open(const char *path, const struct local_bus_control *hello,
                          struct local_bus_control *welcome)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        return -ENAMETOOLONG;
    }
    memcpy(address.sun_path, path, strlen(path) + 1u);
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) {
        return -errno;
    }
    enlarge_buffer(fd);
    int error = 0;
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) != 0 ||
        send(fd, hello, sizeof *hello, MSG_NOSIGNAL) != (ssize_t)sizeof *hello) {
        error = -errno;
    } else {
        error = await_welcome(fd, welcome);
    }
    if (error != 0) {
        (void)close(fd);
        return error;
    }
    return fd;
}
