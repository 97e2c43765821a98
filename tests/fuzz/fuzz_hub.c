/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of hub/hub.h: members, participants and other processes connect, send any packets and leave, in real and
 * in virtual time. It closes connections that send what it does not understand, and serves the next one.
 *
 * Input: the kind of time, then who does what.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). Opens sockets and a
 * pipe; the socket of the hub is a file in /tmp that it removes. A broken rule is printed and aborts the process.
 */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "fuzz.h"
#include "hub/hub.h"

#define CLIENTS   6u
#define STEPS_MAX 400u
#define DRAIN_MAX 4096

static struct hub hub;
static int clients[CLIENTS];
static int
    readable; /* the end of a pipe that always has a byte: a turn of the hub then waits for nothing */
static char path[64];

static void make_pipe(void)
{
    static bool made;
    int ends[2];
    if (!made) {
        FUZZ_CHECK(pipe(ends) == 0 && write(ends[1], "", 1) == 1);
        readable = ends[0];
        (void)snprintf(path, sizeof path, "/tmp/hodograph-fuzz-hub-%ld", (long)getpid());
        made = true;
    }
}

static void drain(int fd)
{
    uint8_t bytes[256];
    int packets = 0;
    while (fd >= 0 && recv(fd, bytes, sizeof bytes, MSG_DONTWAIT) > 0) {
        FUZZ_CHECK(++packets < DRAIN_MAX);
    }
}

static void turn(void)
{
    (void)hub_step(&hub, readable);
    for (unsigned i = 0; i < CLIENTS; ++i) {
        drain(clients[i]);
    }
}

static int come(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    FUZZ_CHECK(fd >= 0);
    if (connect(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        (void)close(fd);
        return -1;
    }
    return fd;
}

static void leave(unsigned i)
{
    if (clients[i] >= 0) {
        (void)close(clients[i]);
        clients[i] = -1;
    }
}

static void say(struct fuzz_input *in, unsigned i, uint8_t kind)
{
    struct local_bus_control control = {
        .mark = LOCAL_BUS_MARK, .version = LOCAL_BUS_VERSION, .kind = kind};
    control.flags = fuzz_byte(in);
    control.number = fuzz_byte(in) & 15u;
    control.time_ns = hub.time.now_ns + ((uint64_t)fuzz_number(in, 2) << (control.flags >> 3));
    fuzz_bytes(in, (uint8_t *)control.name, control.flags & 3u);
    if ((control.flags & 0x80u) != 0u) {
        memset(control.name, 'x', sizeof control.name);
    }
    (void)send(clients[i], &control, sizeof control, MSG_DONTWAIT | MSG_NOSIGNAL);
}

static void say_filters(struct fuzz_input *in, unsigned i)
{
    struct local_bus_filters filters;
    memset(&filters, 0, sizeof filters);
    const uint8_t how = fuzz_byte(in);
    filters.mark = LOCAL_BUS_MARK;
    filters.kind = (how & 1u) != 0u ? LOCAL_BUS_FILTER : LOCAL_BUS_DEFER;
    filters.count = (how & 2u) != 0u ? (uint16_t)fuzz_number(in, 2) : how >> 2;
    const size_t size = (how & 2u) != 0u ? fuzz_number(in, 2) % sizeof filters
                                         : offsetof(struct local_bus_filters, filters) +
                                               (size_t)(how >> 2) * sizeof filters.filters[0];
    fuzz_bytes(in, (uint8_t *)filters.filters, how >> 2);
    (void)send(clients[i], &filters, size < sizeof filters ? size : sizeof filters,
               MSG_DONTWAIT | MSG_NOSIGNAL);
}

static void say_frame(struct fuzz_input *in, unsigned i)
{
    struct can_frame frame;
    memset(&frame, 0, sizeof frame);
    frame.can_id = fuzz_number(in, 4);
    frame.can_dlc = fuzz_byte(in);
    fuzz_bytes(in, frame.data, 2);
    (void)send(clients[i], &frame, sizeof frame, MSG_DONTWAIT | MSG_NOSIGNAL);
}

static void say_anything(struct fuzz_input *in, unsigned i)
{
    uint8_t bytes[512];
    const size_t size = fuzz_number(in, 2) % sizeof bytes;
    fuzz_bytes(in, bytes, size);
    (void)send(clients[i], bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL);
}

static void step(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    const unsigned i = (what & 15u) % CLIENTS;
    if (clients[i] < 0) {
        clients[i] = come();
        turn();
    }
    if (clients[i] < 0) {
        return;
    }
    switch (what >> 4) {
    case 0:
        leave(i);
        break;
    case 1:
    case 2:
        say(in, i, LOCAL_BUS_HELLO_MEMBER);
        break;
    case 3:
    case 4:
        say(in, i, LOCAL_BUS_HELLO_PARTICIPANT);
        break;
    case 5:
    case 6:
    case 7:
        say(in, i, LOCAL_BUS_WAIT);
        break;
    case 8:
        say(in, i, fuzz_byte(in));
        break;
    case 9:
        say_filters(in, i);
        break;
    case 10:
        say_anything(in, i);
        break;
    default:
        say_frame(in, i);
        break;
    }
    turn();
}

/* A new process is greeted. */
static void serves_the_next(void)
{
    const struct local_bus_control hello = {
        .mark = LOCAL_BUS_MARK, .version = LOCAL_BUS_VERSION, .kind = LOCAL_BUS_HELLO_MEMBER};
    struct local_bus_control welcome;
    const int fd = come();
    FUZZ_CHECK(fd >= 0);
    turn();
    FUZZ_CHECK(send(fd, &hello, sizeof hello, MSG_DONTWAIT | MSG_NOSIGNAL) ==
               (ssize_t)sizeof hello);
    turn();
    turn();
    FUZZ_CHECK(recv(fd, &welcome, sizeof welcome, MSG_DONTWAIT) == (ssize_t)sizeof welcome);
    FUZZ_CHECK(welcome.mark == LOCAL_BUS_MARK && welcome.kind == LOCAL_BUS_WELCOME);
    (void)close(fd);
}

static void harness(struct fuzz_input *in)
{
    const char *paths[1];
    size_t failed = 0;
    make_pipe();
    (void)unlink(path);
    paths[0] = path;
    const uint8_t how = fuzz_byte(in);
    const struct hub_options options = {.is_virtual = (how & 1u) != 0u, .bitrate = 1000000};
    FUZZ_CHECK(hub_open(&hub, paths, 1, options, &failed) == 0);
    memset(clients, -1, sizeof clients);
    for (unsigned steps = 0; fuzz_left(in) && steps < STEPS_MAX; ++steps) {
        step(in);
    }
    for (unsigned i = 0; i < CLIENTS; ++i) {
        leave(i);
    }
    turn();
    serves_the_next();
    hub_close(&hub);
    (void)unlink(path);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
