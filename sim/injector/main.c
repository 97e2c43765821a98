/* SPDX-License-Identifier: MIT */
/* hodograph-injector: joins two SocketCAN buses and injects faults. Started by the operator and by host_tools. Receives
 * and sends frames on both buses, reads the file of fault rules, prints what it injects. One thread: it sleeps until
 * frames or a signal come, or a delayed frame is due. */
#define _GNU_SOURCE
#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>

#include "faults/fault_log.h"
#include "faults/fault_rules.h"
#include "injector/forwarder.h"
#include "injector/injector_options.h"
#include "injector/outbox.h"
#include "port/linux/can_socket.h"
#include "port/linux/clock.h"
#include "port/linux/end_signals.h"

/* Below the drives and the controller's tick, so that they finish what they send together; above everything
 * ordinary. */
#define PRIORITY 10

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_BUS = 4 };

struct injector {
    struct can_socket sockets[2]; /* by enum fault_side */
    struct outbox outboxes[2];    /* what waits for the end of a batch, to that side */
    struct fault_rules rules;
    struct forwarder forwarder;
    uint64_t now_ns;
    int failed; /* negative errno of a bus, 0: none */
    bool verbose;
};

static int fail(int status, const char *reason)
{
    (void)fprintf(stderr, "hodograph-injector: %s\n", reason);
    return status;
}

static void send_frame(void *context, enum fault_side to, const struct can_msg *frame)
{
    struct injector *injector = context;
    const int error = outbox_put(&injector->outboxes[to], &injector->sockets[to], frame);
    injector->failed = error != 0 ? error : injector->failed;
}

static void flush_both(struct injector *injector)
{
    for (unsigned side = 0; side < 2u; side++) {
        const int error = outbox_flush(&injector->outboxes[side], &injector->sockets[side]);
        injector->failed = error != 0 ? error : injector->failed;
    }
}

static void note(void *context, const struct fault_trigger *trigger, enum fault_side from,
                 const struct can_msg *frame, bool on)
{
    const struct injector *injector = context;
    const struct fault_event event = {trigger->rule, injector->now_ns,
                                      injector->forwarder.ticks.tick};
    if (!injector->verbose) {
        return;
    }
    if (frame != NULL) {
        fault_log_frame(stdout, &event, from, frame);
    } else {
        fault_log_state(stdout, &event, on);
    }
    (void)fflush(stdout);
}

static int receive(struct injector *injector, enum fault_side from)
{
    struct can_msg frames[CAN_SOCKET_BATCH];
    int more = 1;
    while (more != 0) {
        const int count = can_socket_receive(&injector->sockets[from], frames, &more);
        if (count < 0) {
            return count;
        }
        injector->now_ns = clock_ns();
        for (int i = 0; i < count; i++) {
            forwarder_receive(&injector->forwarder, from, &frames[i], injector->now_ns);
        }
        flush_both(injector);
    }
    return 0;
}

/* Waits until a frame is due. Without a timeout if none is, because setting a timer for every frame costs time. */
static int await(const struct injector *injector, struct pollfd wait[3])
{
    const uint64_t due_ns = forwarder_due_ns(&injector->forwarder);
    if (due_ns == UINT64_MAX) {
        return clock_poll(wait, 2, 3, CLOCK_NEVER);
    }
    const uint64_t now_ns = clock_ns();
    return clock_poll(wait, 2, 3, due_ns > now_ns ? due_ns - now_ns : 0u);
}

static int run(struct injector *injector, int signals)
{
    struct pollfd wait[3] = {{.fd = injector->sockets[0].fd, .events = POLLIN},
                             {.fd = injector->sockets[1].fd, .events = POLLIN},
                             {.fd = signals, .events = POLLIN}};
    while (injector->failed == 0) {
        const int ready = await(injector, wait);
        if (ready < 0 && ready != -EINTR) {
            injector->failed = ready;
        } else if (ready > 0 && wait[2].revents != 0) {
            return EXIT_OK;
        }
        for (unsigned side = 0; side < 2u && ready > 0; side++) {
            if (wait[side].revents != 0) {
                const int error = receive(injector, (enum fault_side)side);
                injector->failed = error != 0 ? error : injector->failed;
            }
        }
        if (ready <= 0 || forwarder_due_ns(&injector->forwarder) != UINT64_MAX) {
            injector->now_ns = clock_ns();
            forwarder_process(&injector->forwarder, injector->now_ns);
            flush_both(injector);
        }
    }
    (void)fprintf(stderr,
                  "hodograph-injector: a bus failed: %s: check the interfaces, start again\n",
                  strerror(-injector->failed));
    return EXIT_BUS;
}

static int start(struct injector *injector, const struct injector_options *options)
{
    char reason[512];
    const struct sched_param priority = {.sched_priority = PRIORITY};
    const int signals = end_signals_open();
    if (options->rules != NULL &&
        fault_rules_read(&injector->rules, options->rules, reason, sizeof reason) != 0) {
        return fail(EXIT_USAGE, reason);
    }
    if (signals < 0) {
        return fail(EXIT_BUS, strerror(errno));
    }
    (void)clock_join(options->bus[0], "injector"); /* opening the sockets reports what is wrong */
    for (unsigned side = 0; side < 2u; side++) {
        if (can_socket_open(&injector->sockets[side], options->bus[side], reason, sizeof reason) !=
            0) {
            return fail(EXIT_BUS, reason);
        }
    }
    injector->verbose = options->verbose;
    forwarder_init(&injector->forwarder, &injector->rules,
                   (struct forwarder_port){send_frame, note, injector});
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
    return run(injector, signals);
}

int main(int argc, char **argv)
{
    static struct injector injector = {.sockets = {{.fd = -1}, {.fd = -1}}};
    struct injector_options options;
    char reason[256];
    switch (injector_options_parse(&options, argc, argv, reason, sizeof reason)) {
    case INJECTOR_OPTIONS_HELP:
        (void)fputs(injector_options_help, stdout);
        return EXIT_OK;
    case INJECTOR_OPTIONS_WRONG:
        return fail(EXIT_USAGE, reason);
    default:
        break;
    }
    const int status = start(&injector, &options);
    can_socket_close(&injector.sockets[0]);
    can_socket_close(&injector.sockets[1]);
    clock_leave();
    return status;
}
