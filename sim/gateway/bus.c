/* SPDX-License-Identifier: MIT */
/* Implements gateway/bus.h (see there): sends frames of the gateway to CAN, counts the signals that end the process,
 * and prints error messages. Used by gateway/main, gateway/fifo_side and gateway/slcan_side. One thread. Sends to the
 * CAN socket, sets signal handlers and the signal mask of the process, and writes to stderr. */
#define _GNU_SOURCE
#include "gateway/bus.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "port/linux/clock.h"

enum { SEND_TRIES = 200 };

static volatile sig_atomic_t signals;

static void on_signal(int number)
{
    if (number != SIGHUP || signals == 0) { /* shell and kernel may both send SIGHUP */
        signals++;
    }
    clock_note_signal();
}

static bool catch_signal(int number)
{
    struct sigaction action;
    memset(&action, 0, sizeof action); /* without SA_RESTART: a wait ends */
    action.sa_handler = on_signal;
    (void)sigemptyset(&action.sa_mask);
    return sigaction(number, &action, NULL) == 0;
}

int bus_catch_signals(void)
{
    struct sigaction before;
    (void)signal(SIGPIPE, SIG_IGN);
    /* A SIGHUP that is ignored, as by nohup, stays ignored. */
    if (sigaction(SIGHUP, NULL, &before) != 0 ||
        (before.sa_handler != SIG_IGN && !catch_signal(SIGHUP))) {
        return -1;
    }
    return catch_signal(SIGTERM) && catch_signal(SIGINT) ? 0 : -1;
}

void bus_unblock_signals(void)
{
    sigset_t ends;
    (void)sigemptyset(&ends);
    (void)sigaddset(&ends, SIGINT);
    (void)sigaddset(&ends, SIGTERM);
    (void)sigaddset(&ends, SIGHUP);
    (void)sigprocmask(SIG_UNBLOCK, &ends, NULL);
}

unsigned bus_signals(void)
{
    return (unsigned)signals;
}

int bus_send(struct can_socket *socket, const struct can_msg *messages, size_t count)
{
    for (int tries = 0; count > 0 && tries < SEND_TRIES;) {
        const int sent = can_socket_send_many(socket, messages, count);
        if (sent > 0) {
            messages += sent;
            count -= (size_t)sent;
        } else if (sent == -EAGAIN) {
            struct pollfd writable = {.fd = socket->fd, .events = POLLOUT};
            (void)poll(&writable, 1, 1);
            tries++;
        } else {
            return sent;
        }
    }
    return count == 0 ? 0 : -ENOBUFS;
}

int bus_complain(int status, const char *what, const char *why)
{
    (void)fprintf(stderr, "hodograph-bridge: %s: %s\n", what, why);
    return status;
}
