/* SPDX-License-Identifier: MIT */
/* can_socket_open() of port/linux/can_socket.h: opens an interface or a local bus, and makes the message for the user
 * if that fails. Used by port/linux and sim/. One thread at a time for each socket, except that can_socket_send may be
 * called by a second one. Opens a socket, and writes the message to the caller's buffer. */
#define _GNU_SOURCE
#include "port/linux/can_socket.h"

#include <errno.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/raw.h>

#include "port/linux/clock.h"
#include "port/linux/local_connection.h"

#define RECEIVE_BUFFER_BYTES (4 * 1024 * 1024)

static int fail(char *reason, size_t size, int error, const char *text, const char *interface)
{
    (void)snprintf(reason, size, text, interface);
    return -error;
}

/* For errors without a text of our own: the text of the system. */
static int fail_plainly(char *reason, size_t size, int error, const char *interface)
{
    (void)snprintf(reason, size, "cannot use %s: %s", interface, strerror(error));
    return -error;
}

static int interface_request(int fd, const char *interface, unsigned long request,
                             struct ifreq *answer)
{
    memset(answer, 0, sizeof *answer);
    memcpy(answer->ifr_name, interface, strlen(interface) + 1u);
    return ioctl(fd, request, answer) == 0 ? 0 : errno;
}

/* Checks in the order in which a user would correct the errors. */
static int check_interface(int fd, const char *interface, char *reason, size_t size)
{
    struct ifreq answer;
    if (strlen(interface) == 0 || strlen(interface) >= IFNAMSIZ) {
        return fail(reason, size, EINVAL, "'%s' is not the name of a network interface", interface);
    }
    int error = interface_request(fd, interface, SIOCGIFHWADDR, &answer);
    if (error == ENODEV) {
        return fail(reason, size, error,
                    "no interface %s: create it (ip link add dev NAME type vcan) or run under "
                    "tools/with-vcan",
                    interface);
    }
    if (error != 0) {
        return fail_plainly(reason, size, error, interface);
    }
    if (answer.ifr_hwaddr.sa_family != ARPHRD_CAN) {
        return fail(reason, size, EINVAL, "%s is not a CAN interface: name one like vcan0 or can0",
                    interface);
    }
    error = interface_request(fd, interface, SIOCGIFFLAGS, &answer);
    if (error == 0 && (answer.ifr_flags & IFF_UP) == 0) {
        return fail(reason, size, ENETDOWN,
                    "interface %s is down: bring it up (ip link set up dev NAME)", interface);
    }
    return error == 0 ? 0 : fail_plainly(reason, size, error, interface);
}

static int bind_interface(int fd, const char *interface, char *reason, size_t size)
{
    struct sockaddr_can address;
    memset(&address, 0, sizeof address);
    address.can_family = AF_CAN;
    address.can_ifindex = (int)if_nametoindex(interface);
    if (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        return fail_plainly(reason, size, errno, interface);
    }
    return 0;
}

/* A simulated bus has no bit times: the buffer must hold all that is sent while the process sleeps for some
 * milliseconds. */
static void enlarge_buffers(int fd)
{
    const int bytes = RECEIVE_BUFFER_BYTES;
    if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    }
    if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    }
}

static int open_raw(const char *interface, char *reason, size_t size)
{
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd >= 0) {
        return fd;
    }
    if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT) {
        return fail(reason, size, errno,
                    "no CAN in this kernel, so no %s: run under tools/with-vcan", interface);
    }
    if (errno == EPERM || errno == EACCES) {
        return fail(reason, size, errno,
                    "no permission to open a CAN socket on %s: run as root or grant it", interface);
    }
    return fail_plainly(reason, size, errno, interface);
}

static int open_local(struct can_socket *socket, const char *path, char *reason, size_t size)
{
    const struct local_bus_control hello = {.mark = LOCAL_BUS_MARK,
                                            .version = LOCAL_BUS_VERSION,
                                            .kind = LOCAL_BUS_HELLO_MEMBER,
                                            .number = clock_participant()};
    struct local_bus_control welcome;
    const int fd = local_connection_open(path, &hello, &welcome);
    switch (fd) {
    case -ENAMETOOLONG:
        return fail(reason, size, ENAMETOOLONG, "%s is too long for the path of a local bus", path);
    case -EPROTO:
    case -ETIMEDOUT:
        return fail(reason, size, -fd, "no hodograph-hub of this version at %s: build both anew",
                    path);
    default:
        break;
    }
    if (fd < 0) {
        return fail(reason, size, -fd, "no local bus at %s: start one there with hodograph-hub",
                    path);
    }
    socket->local = true;
    socket->fd = fd;
    return 0;
}

int can_socket_open(struct can_socket *socket, const char *interface, char *reason, size_t size)
{
    memset(socket, 0, sizeof *socket);
    socket->fd = -1;
    if (local_connection_named(interface)) {
        return open_local(socket, interface, reason, size);
    }
    const int fd = open_raw(interface, reason, size);
    if (fd < 0) {
        return fd;
    }
    int error = check_interface(fd, interface, reason, size);
    if (error == 0) {
        enlarge_buffers(fd);
        error = bind_interface(fd, interface, reason, size);
    }
    if (error != 0) {
        (void)close(fd);
        return error;
    }
    socket->fd = fd;
    return 0;
}
