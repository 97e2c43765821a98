/* SPDX-License-Identifier: MIT */
/* Implements gateway/slcan_side.h (see there): a stream of SLCAN lines (can/slcan.h) on a socket. Called by
 * gateway/main (hodograph-bridge --slcan). One thread. Opens a connection to the board, sends and receives frames, and
 * writes errors to stderr. */
#define _GNU_SOURCE
#include "gateway/slcan_side.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "can/slcan.h"
#include "gateway/bus.h"

#define TEXT_SIZE      4096u
#define SIGNAL_POLL_MS 100 /* latest check for signals on a bus without frames */

static int connect_unix(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    memcpy(address.sun_path, path, strlen(path) + 1u);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        (void)close(fd);
        return -1;
    }
    return fd;
}

/* Every line has to be sent at once. */
static int connect_first(const struct addrinfo *found)
{
    for (; found != NULL; found = found->ai_next) {
        const int on = 1;
        const int fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
        if (fd < 0) {
            continue;
        }
        if (connect(fd, found->ai_addr, found->ai_addrlen) == 0) {
            (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            return fd;
        }
        (void)close(fd);
    }
    return -1;
}

static int connect_tcp(const char *address, const char *port)
{
    char host[256] = {0};
    const size_t length = (size_t)(port - address);
    const struct addrinfo wanted = {.ai_socktype = SOCK_STREAM};
    struct addrinfo *found = NULL;
    if (length >= sizeof host) {
        errno = ENAMETOOLONG;
        return -1;
    }
    memcpy(host, address, length);
    if (getaddrinfo(host, port + 1, &wanted, &found) != 0) {
        errno = EHOSTUNREACH;
        return -1;
    }
    const int fd = connect_first(found);
    freeaddrinfo(found);
    return fd;
}

/* A socket that the caller has opened. */
static int inherited(const char *number)
{
    int fd = 0;
    for (; *number >= '0' && *number <= '9' && fd < 10000; ++number) {
        fd = 10 * fd + (*number - '0');
    }
    errno = *number == '\0' ? EBADF : EINVAL;
    return *number == '\0' && fcntl(fd, F_GETFD) >= 0 ? fd : -1;
}

static int connect_stream(const char *address)
{
    if (strncmp(address, "fd:", 3) == 0) {
        return inherited(address + 3);
    }
    const char *port = strrchr(address, ':');
    return port != NULL && strchr(address, '/') == NULL ? connect_tcp(address, port)
                                                        : connect_unix(address);
}

/* Errors of datagrams that are ignored: the emulator does not receive yet, or has ended after a signal. */
static bool passes_over(int error)
{
    return error == EINTR || error == EAGAIN || (error == ECONNREFUSED && bus_signals() == 0u);
}

/* Reads all available text, which may be many messages of one character. -1: the stream has ended. */
static ssize_t gather(int stream, char text[TEXT_SIZE])
{
    ssize_t size = 0;
    while (size < (ssize_t)TEXT_SIZE) {
        const ssize_t got = recv(stream, text + size, TEXT_SIZE - (size_t)size, MSG_DONTWAIT);
        if (got <= 0) {
            const bool over = got == 0 || !passes_over(errno);
            return over && size == 0 ? -1 : size;
        }
        size += got;
    }
    return size;
}

/* Lines from the board, onto the bus. Returns a negative errno of the bus, 0, or 1 at the end of the stream. */
static int to_bus(struct can_socket *socket, int stream, struct slcan_decoder *decoder)
{
    char text[TEXT_SIZE];
    struct can_msg messages[TEXT_SIZE / 6u +
                            1u]; /* the shortest line has 6 characters; one may have begun before */
    size_t count = 0;
    const ssize_t got = gather(stream, text);
    if (got < 0) {
        return 1;
    }
    for (ssize_t i = 0; i < got; ++i) {
        count += slcan_decode(decoder, text[i], &messages[count]) ? 1u : 0u;
    }
    return bus_send(socket, messages, count);
}

static bool write_all(int stream, const char *text, size_t size)
{
    while (size > 0u) {
        const ssize_t done = write(stream, text, size);
        if (done < 0 && (!passes_over(errno) || bus_signals() > 1u)) {
            return false;
        }
        if (done < 0 && errno == ECONNREFUSED) {
            return true;
        }
        text += done > 0 ? done : 0;
        size -= done > 0 ? (size_t)done : 0u;
    }
    return true;
}

/* Frames of the bus, to the board; likewise. */
static int to_stream(struct can_socket *socket, int stream)
{
    struct can_msg messages[CAN_SOCKET_BATCH];
    char text[CAN_SOCKET_BATCH * SLCAN_LINE_MAX];
    size_t size = 0;
    int more = 0;
    const int count = can_socket_receive(socket, messages, &more);
    if (count < 0) {
        return count;
    }
    for (int i = 0; i < count; ++i) {
        size += slcan_encode(&messages[i], text + size);
    }
    return write_all(stream, text, size) ? 0 : 1;
}

/* Passes on all that has come from both sides; likewise. */
static int pass_on(struct can_socket *socket, int stream, struct slcan_decoder *decoder)
{
    struct pollfd wait[2] = {{.fd = stream, .events = POLLIN},
                             {.fd = socket->fd, .events = POLLIN}};
    int result = 0;
    if (poll(wait, 2, SIGNAL_POLL_MS) < 0) {
        return 0; /* a signal */
    }
    if (wait[0].revents != 0) {
        result = to_bus(socket, stream, decoder);
    }
    return wait[1].revents != 0 && result == 0 ? to_stream(socket, stream) : result;
}

/* Requests the board to end; it stops the axes and switches the drives off, over the bus, before it closes. */
static int end_board(struct can_socket *socket, int stream, struct slcan_decoder *decoder)
{
    int result = write_all(stream, "C\r", 2) ? 0 : 1;
    decoder->closed = false;
    while (result == 0 && !decoder->closed && bus_signals() < 2u) {
        result = pass_on(socket, stream, decoder);
    }
    if (result == 0 && !decoder->closed) {
        return bus_complain(GATEWAY_GONE, "second signal to end", "the board had not closed yet");
    }
    return result < 0 ? result : GATEWAY_OK;
}

static int run(struct can_socket *socket, int stream)
{
    struct slcan_decoder decoder;
    int result = 0;
    memset(&decoder, 0, sizeof decoder);
    while (bus_signals() == 0u && result == 0) {
        result = pass_on(socket, stream, &decoder);
    }
    if (result > 0) {
        return bus_complain(GATEWAY_GONE, "the board is gone", "its stream has ended");
    }
    result = result == 0 ? end_board(socket, stream, &decoder) : result;
    return result < 0 ? bus_complain(GATEWAY_BUS, "the bus failed", strerror(-result)) : result;
}

int slcan_side_run(struct can_socket *socket, const char *address)
{
    const int stream = connect_stream(address);
    if (stream < 0) {
        return bus_complain(GATEWAY_GONE, address, strerror(errno));
    }
    const int status = run(socket, stream);
    (void)close(stream);
    return status;
}
