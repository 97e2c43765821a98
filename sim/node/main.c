/* SPDX-License-Identifier: MIT */
/* hodograph-drive: simulated servo drives on a SocketCAN bus. Started by the operator and by host_tools. Receives and
 * sends frames on the bus, by node/drives; reads the file of fault rules, prints errors. One thread: it sleeps until
 * frames or a signal come. */
#define _GNU_SOURCE
#include <errno.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "faults/fault_rules.h"
#include "node/drives.h"
#include "node/node_options.h"
#include "port/linux/clock.h"
#include "port/linux/end_signals.h"

/* Below the controller's tick, above everything ordinary. */
#define PRIORITY 20

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_BUS = 4, WAKE_NS = 10000000, ASLEEP_US = 1000000 };

/* Reading the real clock costs a system call, as much as a frame: within a run every fourth wake is enough. */
enum { WAKES_PER_CLOCK = 4 };

static int fail(int status, const char *reason)
{
    (void)fprintf(stderr, "hodograph-drive: %s\n", reason);
    return status;
}

static void process(struct drives *drives, uint64_t *last_ns)
{
    const uint64_t us = (clock_ns() - *last_ns) / 1000u;
    *last_ns += us * 1000u;
    if (us > ASLEEP_US) {
        drives_wake(drives);
    }
    drives_process(drives, us < 1000000u ? (uint32_t)us : 1000000u);
}

/* Until a signal (true) or the bus fails (false). */
static bool run(struct drives *drives, int signals)
{
    struct pollfd wait[2] = {{.fd = drives->socket.fd, .events = POLLIN},
                             {.fd = signals, .events = POLLIN}};
    uint64_t last_ns = clock_ns();
    int wakes = 0;
    process(drives, &last_ns);
    while (drives->failed == 0) {
        const int ready = clock_poll(wait, 1, 2, WAKE_NS);
        if (ready < 0 && ready != -EINTR) {
            drives->failed = ready;
        } else if (ready > 0 && wait[1].revents != 0) {
            return true;
        } else if (ready > 0 && drives_receive(drives)) {
            wakes = WAKES_PER_CLOCK;
        }
        wakes++;
        if (ready <= 0 || wakes >= WAKES_PER_CLOCK || clock_is_virtual()) {
            process(drives, &last_ns);
            wakes = 0;
        }
    }
    return false;
}

/* Real drives answer within a fraction of the period; where a priority is not permitted, the host's scheduler
 * decides. */
static void request_priority(void)
{
    const struct sched_param priority = {.sched_priority = PRIORITY};
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
}

static int start(struct drives *drives, const struct node_options *options)
{
    char reason[512];
    char name[32];
    uint8_t node = 0;
    const int signals = end_signals_open();
    if (options->faults != NULL &&
        fault_rules_read(&drives->rules, options->faults, reason, sizeof reason) != 0) {
        return fail(EXIT_USAGE, reason);
    }
    const int error = drives_init(drives, options, &node);
    if (error != 0) {
        (void)snprintf(reason, sizeof reason, "--axis of node %u: %s", node,
                       error == DRIVES_ERR_EQUIPMENT ? equipment_rule : drive_error_text(error));
        return fail(EXIT_USAGE, reason);
    }
    if (signals < 0) {
        return fail(EXIT_BUS, strerror(errno));
    }
    (void)snprintf(name, sizeof name, "drive-%u",
                   options->axis_count > 0 ? drives->nodes[0].id : options->module);
    (void)clock_join(options->bus,
                     name); /* opening the socket reports what is wrong with the bus */
    if (can_socket_open(&drives->socket, options->bus, reason, sizeof reason) != 0) {
        return fail(EXIT_BUS, reason);
    }
    const int filtered = drives_filter(drives);
    request_priority();
    if (filtered != 0) {
        return fail(EXIT_BUS, strerror(-filtered));
    }
    if (run(drives, signals)) {
        return EXIT_OK;
    }
    (void)snprintf(reason, sizeof reason, "the bus failed: %s: check the interface and start again",
                   strerror(-drives->failed));
    return fail(EXIT_BUS, reason);
}

int main(int argc, char **argv)
{
    static struct drives drives = {.socket.fd = -1};
    struct node_options options;
    char reason[256];
    switch (node_options_parse(&options, argc, argv, reason, sizeof reason)) {
    case NODE_OPTIONS_HELP:
        (void)fputs(node_options_help, stdout);
        return EXIT_OK;
    case NODE_OPTIONS_WRONG:
        return fail(EXIT_USAGE, reason);
    default:
        break;
    }
    const int status = start(&drives, &options);
    can_socket_close(&drives.socket);
    clock_leave();
    return status;
}
