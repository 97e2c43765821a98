/* SPDX-License-Identifier: MIT */
/* hodograph-bridge: the gateway between an emulated board, or one without SocketCAN, and a CAN interface. Started by
 * the operator, tools/emulate.py and tests. Moves frames between the bus and the FIFOs or the serial line of the board.
 * One thread: it sleeps until frames or a signal come. */
#define _GNU_SOURCE
#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>

#include "gateway/bus.h"
#include "gateway/fifo_side.h"
#include "gateway/gateway_options.h"
#include "gateway/slcan_side.h"
#include "port/linux/clock.h"

/* A batch thread is woken once for all answers of the drives, or all characters of a UART, not by the first of them. A
 * real-time priority that the process was started with stays. */
static void use_batch_scheduling(void)
{
    if (sched_getscheduler(0) != SCHED_OTHER) {
        return;
    }
    const struct sched_param none = {.sched_priority = 0};
    (void)sched_setscheduler(0, SCHED_BATCH, &none);
}

static int run(const struct gateway_options *options)
{
    char reason[512];
    struct can_socket socket;
    if (bus_catch_signals() != 0) {
        return bus_complain(GATEWAY_GONE, "cannot catch signals", strerror(errno));
    }
    (void)clock_join(options->bus,
                     "bridge"); /* opening the socket reports what is wrong with the bus */
    bus_unblock_signals();
    if (can_socket_open(&socket, options->bus, reason, sizeof reason) != 0) {
        return bus_complain(GATEWAY_BUS, options->bus, reason);
    }
    use_batch_scheduling();
    const int status = options->slcan != NULL ? slcan_side_run(&socket, options->slcan)
                                              : fifo_side_run(&socket, options->out, options->in);
    can_socket_close(&socket);
    clock_leave();
    return status;
}

int main(int argc, char **argv)
{
    char reason[512];
    struct gateway_options options;
    switch (gateway_options_parse(&options, argc, argv, reason, sizeof reason)) {
    case GATEWAY_OPTIONS_OK:
        return run(&options);
    case GATEWAY_OPTIONS_HELP:
        (void)fputs(gateway_options_help, stdout);
        return 0;
    default:
        return bus_complain(GATEWAY_USAGE, "command line", reason);
    }
}
