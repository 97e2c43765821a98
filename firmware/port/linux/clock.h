/* SPDX-License-Identifier: MIT */
/*
 * clock: the time of a process, for the Linux port and the programs of sim/. It is the monotonic clock of the system.
 * If the process takes part in a local bus with virtual time (local_bus.h), it is that virtual time. Used by port/linux
 * and sim/. In virtual time it opens a connection to the hub, sends and receives on it, and blocks the three signals
 * outside of clock_poll().
 *
 * The state is one for the whole process. One thread uses all functions in virtual time, except clock_note_signal
 * (signal handlers). It sleeps in clock_poll() only: what it does between two calls takes no virtual time. SIGINT,
 * SIGTERM and SIGHUP arrive while it sleeps there. A process that lets them arrive at other times reports each with
 * clock_note_signal(). In real time clock_ns and clock_poll may be called from any thread. Users define _GNU_SOURCE
 * first.
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

/* Joins the virtual time of this bus; does nothing if its time is real. Call it before can_socket_open(). `name`: the
 * name of the participant, unless the environment has another one in LOCAL_BUS_NAME_VARIABLE. Returns 0 or a negative
 * errno. */
int clock_join(const char *bus, const char *name);

/* Leaves virtual time, so that nobody waits for this process. Does nothing in real time. */
void clock_leave(void);

bool clock_is_virtual(void);

/* The number of this process for the members that wake it; 0 without virtual time. */
uint32_t clock_participant(void);

/* Reports that a member of this process has sent something: the hub reads it when the process waits. */
void clock_note_sent(void);

/* Whether frames that are deferred (can_socket_defer) end the waits from now on; at first they do not. */
void clock_wake_for_all(bool on);

/* Reports a signal outside of clock_poll(): the next clock_poll ends at once, and the hub notifies the participants
 * that requested notices. For signal handlers. */
void clock_note_signal(void);

/* Monotonic. */
uint64_t clock_ns(void);

/* As ppoll(): waits until one of `fds` is ready, a signal comes or `timeout_ns` (CLOCK_NEVER: no limit) are over. The
 * first `buses` of `fds` are sockets of CAN buses. Returns how many are ready, or a negative errno: -EINTR in real time
 * only, -ENETDOWN if the hub has ended. */
int clock_poll(struct pollfd *fds, size_t buses, size_t count, uint64_t timeout_ns);

static inline struct timespec clock_timespec(uint64_t ns)
{
    struct timespec time;
    time.tv_sec = (time_t)(ns / CLOCK_NS_PER_S);
    time.tv_nsec = (long)(ns % CLOCK_NS_PER_S);
    return time;
}

#endif
