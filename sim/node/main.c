/* SPDX-License-Identifier: MIT */
/* hodograph-drive: simulated servo drives on a SocketCAN bus. One thread: it sleeps until frames or
 * a signal come. */
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "canopen/cob.h"
#include "node/drive_node.h"
#include "node/node_options.h"
#include "port/linux/can_socket.h"
#include "port/linux/clock.h"

/* Below the controller's tick, above everything ordinary. */
#define PRIORITY 20

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_BUS = 4, WAKE_MS = 10, SEND_TRIES = 200 };

/* Looking at the clock costs a system call, as much as a frame: within a run every fourth wake is enough. */
enum { WAKES_PER_LOOK = 4 };

struct drives {
    struct can_socket socket;
    struct drive_node nodes[NODE_OPTIONS_AXES];
    size_t count;
    int failed; /* negative errno of the bus, 0: none */
    int wakes;  /* since the last look at the clock */
};

static int complain(int status, const char *reason)
{
    (void)fprintf(stderr, "hodograph-drive: %s\n", reason);
    return status;
}

/* A full queue of the interface empties within a few frame times: wait for it. */
static void send_frame(void *context, const struct can_msg *frame)
{
    struct drives *drives = context;
    int result = -EAGAIN;
    for (int i = 0; i < SEND_TRIES && result == -EAGAIN; i++) {
        result = can_socket_send(&drives->socket, frame);
        if (result == -EAGAIN) {
            struct pollfd writable = {.fd = drives->socket.fd, .events = POLLOUT};
            (void)poll(&writable, 1, 1);
        }
    }
    if (result != 0) {
        drives->failed = result;
    }
}

/* Only what the nodes want wakes the process: 15 filters for 6 drives. */
static int set_filters(struct drives *drives)
{
    struct can_socket_filter filters[3 + 2 * NODE_OPTIONS_AXES] = {
        {COB_NMT, CAN_ID_MAX}, {COB_SYNC, CAN_ID_MAX}, {COB_HEARTBEAT, 0x780}};
    size_t n = 3;
    for (size_t i = 0; i < drives->count; i++) {
        filters[n++] =
            (struct can_socket_filter){(uint16_t)(COB_RPDO1 + drives->nodes[i].id), CAN_ID_MAX};
        filters[n++] =
            (struct can_socket_filter){(uint16_t)(COB_SDO_ASK + drives->nodes[i].id), CAN_ID_MAX};
    }
    return can_socket_filter(&drives->socket, filters, n);
}

static int make_nodes(struct drives *drives, const struct node_options *options)
{
    const struct drive_node_port port = {send_frame, drives};
    for (size_t i = 0; i < options->axis_count; i++) {
        const struct node_options_axis *axis = &options->axes[i];
        const int32_t start =
            encoder_to_i32(axis->position_mm * (double)axis->config.counts_per_mm);
        const int error =
            drive_node_init(&drives->nodes[i], axis->node, &axis->config, start, port);
        if (error != 0) {
            (void)fprintf(stderr, "hodograph-drive: --axis of node %u: %s\n", axis->node,
                          drive_error_text(error));
            return EXIT_USAGE;
        }
        drives->count++;
    }
    return EXIT_OK;
}

/* Cyclic frames need no process(); others (NMT, SDO, heartbeat) want it at once. */
static bool cyclic(const struct drives *drives, const struct can_msg *frame)
{
    for (size_t i = 0; i < drives->count; i++) {
        if (frame->id == COB_RPDO1 + drives->nodes[i].id) {
            return true;
        }
    }
    return frame->id == COB_SYNC;
}

static int receive(struct drives *drives)
{
    struct can_msg frames[CAN_SOCKET_BATCH];
    int more = 1;
    while (more != 0) {
        const int count = can_socket_receive(&drives->socket, frames, &more);
        if (count < 0) {
            return count;
        }
        for (int k = 0; k < count; k++) {
            drives->wakes += cyclic(drives, &frames[k]) ? 0 : WAKES_PER_LOOK;
            for (size_t i = 0; i < drives->count; i++) {
                drive_node_receive(&drives->nodes[i], &frames[k]);
            }
        }
    }
    return 0;
}

static void process(struct drives *drives, uint64_t *last_ns)
{
    const uint64_t us = (clock_ns() - *last_ns) / 1000u;
    *last_ns += us * 1000u;
    for (size_t i = 0; i < drives->count; i++) {
        drive_node_process(&drives->nodes[i], us < 1000000u ? (uint32_t)us : 1000000u);
    }
}

static int run(struct drives *drives, int signals)
{
    struct pollfd wait[2] = {{.fd = drives->socket.fd, .events = POLLIN},
                             {.fd = signals, .events = POLLIN}};
    uint64_t last_ns = clock_ns();
    process(drives, &last_ns);
    while (drives->failed == 0) {
        const int ready = poll(wait, 2, WAKE_MS);
        if (ready < 0 && errno != EINTR) {
            drives->failed = -errno;
        } else if (wait[1].revents != 0) {
            return EXIT_OK;
        } else if (wait[0].revents != 0) {
            const int error = receive(drives);
            drives->failed = error != 0 ? error : drives->failed;
        }
        drives->wakes++;
        if (ready <= 0 || drives->wakes >= WAKES_PER_LOOK) {
            process(drives, &last_ns);
            drives->wakes = 0;
        }
    }
    (void)fprintf(stderr,
                  "hodograph-drive: the bus failed: %s: check the interface and start again\n",
                  strerror(-drives->failed));
    return EXIT_BUS;
}

/* Ends come as readable bytes, so that no handler runs in the middle of anything. */
static int open_signals(void)
{
    sigset_t set;
    (void)sigemptyset(&set);
    (void)sigaddset(&set, SIGTERM);
    (void)sigaddset(&set, SIGINT);
    (void)sigprocmask(SIG_BLOCK, &set, NULL);
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

/* Real drives answer within a fraction of the period; where that is not permitted, the host's scheduler decides. */
static void ask_for_priority(void)
{
    const struct sched_param priority = {.sched_priority = PRIORITY};
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
}

static int start(struct drives *drives, const struct node_options *options)
{
    char reason[256];
    const int signals = open_signals();
    const int status = make_nodes(drives, options);
    if (status != EXIT_OK) {
        return status;
    }
    if (signals < 0) {
        return complain(EXIT_BUS, strerror(errno));
    }
    if (can_socket_open(&drives->socket, options->bus, reason, sizeof reason) != 0) {
        return complain(EXIT_BUS, reason);
    }
    const int filtered = set_filters(drives);
    ask_for_priority();
    return filtered == 0 ? run(drives, signals) : complain(EXIT_BUS, strerror(-filtered));
}

int main(int argc, char **argv)
{
    static struct drives drives;
    struct node_options options;
    char reason[256];
    switch (node_options_parse(&options, argc, argv, reason, sizeof reason)) {
    case NODE_OPTIONS_HELP:
        (void)fputs(node_options_help, stdout);
        return EXIT_OK;
    case NODE_OPTIONS_WRONG:
        return complain(EXIT_USAGE, reason);
    default:
        break;
    }
    const int status = start(&drives, &options);
    can_socket_close(&drives.socket);
    return status;
}
