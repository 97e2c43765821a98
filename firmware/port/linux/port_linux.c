/* SPDX-License-Identifier: MIT */
/* Implements port/port.h for Linux: SocketCAN, a thread for the interrupts, main() for the main loop. Used by
 * firmware/app and the ports. Contexts: port/port.h. Opens the bus and the store, starts a thread, sets signal
 * handlers, and writes to stderr. */
#define _GNU_SOURCE
#include "port/port.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "port/linux/can_socket.h"
#include "port/linux/clock.h"
#include "port/linux/interrupts.h"
#include "port/linux/options.h"
#include "port/linux/store.h"

#define LOST_NS 100000000u /* real drives have long stopped by then */

enum exit_status { EXIT_MACHINE = 1, EXIT_USAGE = 2, EXIT_BUS = 4 };

static struct {
    struct options options;
    struct can_socket socket;
    int wake_fd;
    bool waits; /* frames of ticks, for the bus */
    uint64_t waits_since_ns;
    volatile sig_atomic_t stop;  /* signals so far, 2 at most */
    volatile sig_atomic_t woken; /* virtual time: the main loop has something to do */
} self;

static void on_signal(int number)
{
    const int most = number == SIGHUP ? 1 : 2; /* shell and kernel may both send SIGHUP */
    self.stop = self.stop < most ? self.stop + 1 : self.stop;
    port_wake();
}

static int set_signals(void (*handler)(int))
{
    struct sigaction action;
    struct sigaction before;
    memset(&action, 0, sizeof action);
    action.sa_handler = handler;
    (void)sigemptyset(&action.sa_mask);
    (void)signal(SIGPIPE, SIG_IGN); /* the reader of stderr may end before the axes stand */
    if (sigaction(SIGHUP, NULL, &before) != 0 ||
        (before.sa_handler != SIG_IGN && sigaction(SIGHUP, &action, NULL) != 0)) { /* nohup */
        return PORT_ERR_SYSTEM;
    }
    return sigaction(SIGTERM, &action, NULL) == 0 && sigaction(SIGINT, &action, NULL) == 0
               ? 0
               : PORT_ERR_SYSTEM;
}

static int open_bus(void)
{
    char reason[160];
    char name[32];
    (void)snprintf(name, sizeof name, "controller-%u", self.options.node);
    (void)clock_join(self.options.bus,
                     name); /* opening the socket reports what is wrong with the bus */
    if (can_socket_open(&self.socket, self.options.bus, reason, sizeof reason) == 0) {
        return 0;
    }
    (void)fprintf(stderr, "hodograph-controller: %s\n", reason);
    return EXIT_BUS;
}

int port_begin(int argc, char **argv)
{
    const enum options_result parsed = options_parse(&self.options, argc, argv);
    if (parsed == OPTIONS_HELP) {
        exit(EXIT_SUCCESS);
    }
    if (parsed != OPTIONS_OK) {
        return EXIT_USAGE;
    }
    if (store_open(self.options.store) != 0) {
        return EXIT_MACHINE;
    }
    store_ring(self.options.ring_kib * 1024u);
    const int status = open_bus();
    if (status != 0) {
        return status;
    }
    self.wake_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (self.wake_fd < 0 || set_signals(on_signal) != 0 ||
        interrupts_begin(&self.socket, self.options.pace == OPTIONS_FAST) != 0) {
        (void)fprintf(stderr, "hodograph-controller: cannot prepare the process: %s\n",
                      strerror(errno));
        return EXIT_MACHINE;
    }
    return 0;
}

/* Removes the signal handler first, because it writes to wake_fd; the process ends in any case. */
int port_end(void)
{
    (void)set_signals(SIG_IGN);
    interrupts_end();
    can_socket_close(&self.socket);
    clock_leave();
    (void)close(self.wake_fd);
    self.wake_fd = -1;
    const int error = interrupts_error();
    if (error == 0) {
        return 0;
    }
    (void)fprintf(stderr, "hodograph-controller: %s is gone: %s\n", self.options.bus,
                  strerror(-error));
    return EXIT_BUS;
}

/* The end of the bus also ends the controller. */
bool port_stop_requested(void)
{
    return self.stop != 0 || interrupts_error() != 0;
}

bool port_stop_insisted(void)
{
    return self.stop > 1;
}

uint8_t port_node_id(void)
{
    return self.options.node;
}

/* The next tick needs the answers of drives to a SYNC (TPDO1): in virtual time the process does not wake for each. */
int port_can_accept(const struct can_match *filters, size_t count)
{
    static const struct can_match answers = {0x180u, 0x780u};
    if (can_socket_filter(&self.socket, filters, count) != 0) {
        return PORT_ERR_SYSTEM;
    }
    return can_socket_defer(&self.socket, &answers, 1) == 0 ? 0 : PORT_ERR_SYSTEM;
}

/* A frame that cannot be tracked counts as delivered. */
static int send_from_tick(const struct can_msg *message)
{
    const bool tracked = can_socket_track(&self.socket, (uint16_t)message->id) == 0;
    const int error = can_socket_send(&self.socket, message);
    if (error != 0 && tracked) {
        can_socket_untrack(&self.socket, (uint16_t)message->id);
    }
    return error;
}

int port_can_send(const struct can_msg *message)
{
    const int error =
        interrupts_in_tick() ? send_from_tick(message) : can_socket_send(&self.socket, message);
    return error == 0 ? 0 : PORT_ERR_FULL;
}

/* An interface that goes bus-off drops the frames that it was to send, without a report. On a local bus nothing is
 * lost. */
bool port_can_delivered(void)
{
    if (can_socket_waiting(&self.socket) == 0u) {
        self.waits = false;
        return true;
    }
    const uint64_t now_ns = clock_ns();
    if (!self.waits) {
        self.waits = true;
        self.waits_since_ns = now_ns;
    }
    if (!self.socket.local && now_ns - self.waits_since_ns > LOST_NS) {
        can_socket_forget(&self.socket);
        self.waits = false;
    }
    return !self.waits;
}

uint32_t port_time_ns(void)
{
    return (uint32_t)clock_ns();
}

uint32_t port_time_us(void)
{
    return (uint32_t)(clock_ns() / 1000u);
}

int port_start(const struct port_handlers *handlers, uint32_t period_us)
{
    return interrupts_start(handlers, period_us);
}

/* One thread: only a signal handler can write to wake_fd while it waits. */
static void wait_virtually(uint32_t timeout_us)
{
    const uint64_t end_ns = clock_ns() + (uint64_t)timeout_us * 1000u;
    while (!self.woken && clock_is_virtual() && clock_ns() < end_ns) {
        interrupts_run(end_ns - clock_ns());
    }
    self.woken = 0;
}

static void wait_really(uint32_t timeout_us)
{
    struct pollfd waited = {.fd = self.wake_fd, .events = POLLIN, .revents = 0};
    if (clock_poll(&waited, 0, 1, (uint64_t)timeout_us * 1000u) > 0) {
        uint64_t count = 0;
        if (read(self.wake_fd, &count, sizeof count) < 0) {
            return; /* the wake has been taken already */
        }
    }
}

void port_wait(uint32_t timeout_us)
{
    timeout_us = timeout_us < INTERRUPTS_SLEEP_MAX_US ? timeout_us : INTERRUPTS_SLEEP_MAX_US;
    interrupts_main_loop_sleeps();
    if (clock_is_virtual()) {
        wait_virtually(timeout_us);
    } else {
        wait_really(timeout_us);
    }
}

void port_progress(void)
{
}

void port_wake(void)
{
    const uint64_t one = 1;
    self.woken = 1;
    if (!clock_is_virtual() && write(self.wake_fd, &one, sizeof one) < 0) {
        return; /* the counter is full: it wakes in any case */
    }
}

enum port_timing port_timing(void)
{
    if (interrupts_keep_time()) {
        return PORT_TIMING_KEPT;
    }
    return self.options.no_realtime ? PORT_TIMING_ACCEPTED : PORT_TIMING_REFUSED;
}

void port_log(enum port_level level, const char *text, int32_t value)
{
    if (level == PORT_WARNING || self.options.verbose) {
        (void)fprintf(stderr, "hodograph-controller: %s %ld\n", text, (long)value);
    }
}
