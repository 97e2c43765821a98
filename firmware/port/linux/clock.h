/* SPDX-License-Identifier: MIT */
/*
 * clock: the time of a process of this computer, for the Linux port and the simulated drives. It is the monotonic clock
 * of the system. Where the process takes part in a local bus with virtual time (local_bus.h), it is that virtual time.
 *
 * One thread of a process takes part. It sleeps in clock_poll() only: what it does between two calls takes no virtual
 * time. SIGINT and SIGTERM arrive while it sleeps there. A process that lets them arrive at other times reports each
 * with clock_note_signal(). Users define _GNU_SOURCE first.
 */
#ifndef PORT_LINUX_CLOCK_H
#define PORT_LINUX_CLOCK_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#define CLOCK_NS_PER_S 1000000000u
#define CLOCK_NEVER    UINT64_MAX

/* Takes part in the time of this bus from now on, where its time is virtual; else changes nothing. Call it before
 * can_socket_open(). `name`: what others know the process by, unless LOCAL_BUS_NAME_VARIABLE of the environment has
 * another name. Returns 0 or a negative errno. */
int clock_join(const char *bus, const char *name);

/* Ends the part in virtual time: nobody waits for this process any more. Harmless without one. */
void clock_leave(void);

bool clock_is_virtual(void);

/* The number of this process for the members that wake it; 0 without virtual time. */
uint32_t clock_participant(void);

/* A member of this process has sent something: the hub looks for it when the process waits. */
void clock_note_sent(void);

/* Whether frames that are deferred (can_socket_defer) end the waits from now on; at first they do not. */
void clock_wake_for_all(bool on);

/* A signal has come outside of clock_poll(): the next one ends at once, and the hub reports it to those who watch. For
 * signal handlers. */
void clock_note_signal(void);

/* Monotonic. */
uint64_t clock_ns(void);

/* As ppoll(): until one of `fds` is ready, a signal comes or `timeout_ns` (CLOCK_NEVER: no limit) are over. The first
 * `buses` of `fds` are sockets of CAN buses. Returns how many are ready, or a negative errno: -EINTR in real time only,
 * -ENETDOWN when the hub has gone. */
int clock_poll(struct pollfd *fds, size_t buses, size_t count, uint64_t timeout_ns);

static inline struct timespec clock_timespec(uint64_t ns)
{
    struct timespec time;
    time.tv_sec = (time_t)(ns / CLOCK_NS_PER_S);
    time.tv_nsec = (long)(ns % CLOCK_NS_PER_S);
    return time;
}

#endif
