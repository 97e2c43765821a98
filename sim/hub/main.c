/* SPDX-License-Identifier: MIT */
/* hodograph-hub: a CAN bus for the processes of one machine, whose kernel need not have CAN. */
#define _GNU_SOURCE
#include <inttypes.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "hub/hub.h"
#include "port/linux/end_signals.h"

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_BUS = 4 };

static const char help[] =
    "usage: hodograph-hub PATH\n"
    "\n"
    "A CAN bus for processes of this machine, at PATH, until SIGTERM or SIGINT: --bus PATH of "
    "hodograph-controller,\n"
    "hodograph-drive and hodograph-bridge, --bus local:PATH of hodograph. The kernel need not have "
    "CAN (docs/target.md).\n"
    "\n"
    "Exit status: 0 ended as asked, 2 wrong usage, 4 no bus can be made at PATH.\n";

/* Above the simulated drives (20), where that is permitted: a real bus does not wait for anybody. */
static void ask_for_priority(void)
{
    const struct sched_param priority = {.sched_priority = 25};
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
}

static int serve(const char *path)
{
    static struct hub hub;
    const int end = end_signals_open();
    const int error = hub_open(&hub, path);
    if (error != 0 || end < 0) {
        (void)fprintf(stderr, "hodograph-hub: no bus at %s: %s\n", path, strerror(-error));
        return EXIT_BUS;
    }
    ask_for_priority();
    while (hub_turn(&hub, end)) {
    }
    hub_close(&hub);
    (void)unlink(path);
    if (hub.lost > 0u) {
        (void)fprintf(stderr,
                      "hodograph-hub: %" PRIu64
                      " frames were lost by members that did not take them\n",
                      hub.lost);
    }
    return EXIT_OK;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        (void)fputs(help, stdout);
        return EXIT_OK;
    }
    if (argc != 2 || strchr(argv[1], '/') == NULL) {
        (void)fprintf(stderr, "hodograph-hub: give it one path with a '/' in it (see --help)\n");
        return EXIT_USAGE;
    }
    return serve(argv[1]);
}
