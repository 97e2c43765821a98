/* SPDX-License-Identifier: MIT */
/* Implements port/linux/clock.h (see there): the time of a process of this computer, for the Linux port and the
 * simulated drives. Used by port/linux and sim/. Any thread in real time, one thread in virtual time. In virtual time
 * it opens a connection to the hub, sends and receives on it, and blocks the three signals outside of clock_poll(). */
#define _GNU_SOURCE
#include "port/linux/clock.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "port/linux/local_bus.h"
#include "port/linux/local_connection.h"

enum { OTHERS_MAX = 3 }; /* descriptors that may wake the process, other than buses */

static struct {
    int fd; /* to the hub; meaningful while `joined` */
    bool joined;
    bool sent;
    bool all; /* deferred frames wake it as well */
    uint32_t number;
    uint32_t grant; /* number of the last one */
    bool frames;    /* some came with it */
    uint64_t now_ns;
    sigset_t signals; /* the mask before joining: signals that may come during a wait */
} self;

static uint64_t monotonic_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * CLOCK_NS_PER_S + (uint64_t)now.tv_nsec;
}

bool clock_is_virtual(void)
{
    return self.joined;
}

uint32_t clock_participant(void)
{
    return self.joined ? self.number : 0u;
}

void clock_note_sent(void)
{
    self.sent = true;
}

void clock_wake_for_all(bool on)
{
    self.all = on;
}

uint64_t clock_ns(void)
{
    return self.joined ? self.now_ns : monotonic_ns();
}

static volatile sig_atomic_t signal_noted;

void clock_note_signal(void)
{
    signal_noted = 1;
}

static void block_signals(sigset_t *before)
{
    sigset_t ends;
    (void)sigemptyset(&ends);
    (void)sigaddset(&ends, SIGINT);
    (void)sigaddset(&ends, SIGTERM);
    (void)sigaddset(&ends, SIGHUP);
    (void)pthread_sigmask(SIG_BLOCK, &ends, before);
}

int clock_join(const char *bus, const char *name)
{
    struct local_bus_control hello = {
        .mark = LOCAL_BUS_MARK, .version = LOCAL_BUS_VERSION, .kind = LOCAL_BUS_HELLO_PARTICIPANT};
    struct local_bus_control welcome;
    const char *given = getenv(LOCAL_BUS_NAME_VARIABLE);
    if (!local_connection_named(bus)) {
        return 0;
    }
    name = given != NULL ? given : name;
    memcpy(hello.name, name, strnlen(name, sizeof hello.name - 1u));
    const int fd = local_connection_open(bus, &hello, &welcome);
    if (fd < 0) {
        return fd;
    }
    if ((welcome.flags & LOCAL_BUS_VIRTUAL) == 0u) {
        (void)close(fd);
        return 0;
    }
    block_signals(&self.signals);
    self.fd = fd;
    self.joined = true;
    self.all = false;
    self.number = welcome.number;
    self.grant = 0;
    self.now_ns = welcome.time_ns;
    return 0;
}

void clock_leave(void)
{
    if (self.joined) {
        (void)close(self.fd);
        self.joined = false;
        (void)pthread_sigmask(SIG_SETMASK, &self.signals, NULL);
    }
}

static int say_wait(uint64_t until_ns)
{
    const uint16_t flags =
        (uint16_t)((self.sent ? LOCAL_BUS_SENT : 0) | (self.all ? LOCAL_BUS_ALL : 0));
    const struct local_bus_control wait = {.flags = flags,
                                           .mark = LOCAL_BUS_MARK,
                                           .version = LOCAL_BUS_VERSION,
                                           .kind = LOCAL_BUS_WAIT,
                                           .number = self.grant,
                                           .time_ns = until_ns};
    self.sent = false;
    return send(self.fd, &wait, sizeof wait, MSG_NOSIGNAL) == (ssize_t)sizeof wait ? 0 : -ENETDOWN;
}

/* True with the next grant; false when it is not there yet. */
static int take_grant(void)
{
    struct local_bus_control grant;
    const ssize_t size = recv(self.fd, &grant, sizeof grant, MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
        return 0;
    }
    if (size != (ssize_t)sizeof grant || grant.kind != LOCAL_BUS_GRANT) {
        return -ENETDOWN;
    }
    self.grant = grant.number;
    self.now_ns = grant.time_ns;
    self.frames = (grant.flags & LOCAL_BUS_FRAMES) != 0u;
    return 1;
}

/* A signal, or a descriptor that is no bus, ends the wait at the present time: requests a grant at once from the hub.
 * This has no effect if one has been sent already. */
static int await_grant(const struct pollfd *others, size_t count, bool *interrupted)
{
    struct pollfd wait[1 + OTHERS_MAX];
    size_t watched = count < (size_t)OTHERS_MAX ? count : (size_t)OTHERS_MAX;
    int granted = 0;
    *interrupted = false;
    memset(wait, 0, sizeof wait);
    wait[0] = (struct pollfd){.fd = self.fd, .events = POLLIN, .revents = 0};
    if (watched > 0u) {
        memcpy(wait + 1, others, watched * sizeof wait[0]);
    }
    while (granted == 0) {
        const int ready = ppoll(wait, 1u + watched, NULL, &self.signals);
        const bool grant_came = ready > 0 && wait[0].revents != 0;
        if (grant_came) {
            granted = take_grant();
        } else if (ready > 0 || errno == EINTR) {
            granted = say_wait(0);
            watched = 0; /* reported once */
            *interrupted = true;
        } else {
            granted = -errno;
        }
    }
    return granted < 0 ? granted : 0;
}

/* Reports to the hub that this process waits. A signal that came before is reported by a second message. */
static int begin_wait(uint64_t timeout_ns)
{
    const uint64_t left_ns = LOCAL_BUS_NEVER - self.now_ns;
    const bool noted = signal_noted != 0;
    const int error = say_wait(timeout_ns < left_ns ? self.now_ns + timeout_ns : LOCAL_BUS_NEVER);
    signal_noted = 0;
    return noted && error == 0 ? say_wait(0) : error;
}

/* Signals are blocked from here to ppoll(): one that comes between the message to the hub and the wait itself would be
 * missed. */
static int poll_virtually(struct pollfd *fds, size_t buses, size_t count, uint64_t timeout_ns)
{
    bool interrupted = false;
    sigset_t before;
    block_signals(&before);
    int error = begin_wait(timeout_ns);
    if (error == 0) {
        error = await_grant(fds + buses, count - buses, &interrupted);
    }
    signal_noted = 0; /* the hub has been notified of those that ended the wait */
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (error != 0) {
        return error;
    }
    if (interrupted) {
        const int ready = poll(fds, count, 0);
        return ready < 0 ? 0 : ready;
    }
    for (size_t i = 0; i < count; ++i) {
        fds[i].revents = i < buses && self.frames ? POLLIN : 0;
    }
    return self.frames ? (int)buses : 0;
}

int clock_poll(struct pollfd *fds, size_t buses, size_t count, uint64_t timeout_ns)
{
    if (self.joined) {
        return poll_virtually(fds, buses, count, timeout_ns);
    }
    const struct timespec limit = clock_timespec(timeout_ns);
    const int ready = ppoll(fds, count, timeout_ns == CLOCK_NEVER ? NULL : &limit, NULL);
    return ready < 0 ? -errno : ready;
}
