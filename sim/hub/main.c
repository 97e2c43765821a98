/* SPDX-License-Identifier: MIT */
/* hodograph-hub: CAN buses for the processes of one computer, without kernel CAN. Started by the operator and by
 * host_tools (bus/hub). Opens the buses by hub/hub, and prints errors. One thread: it sleeps until frames, a connection
 * or a signal come. */
#define _GNU_SOURCE
#include <getopt.h>
#include <inttypes.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "hub/hub.h"
#include "port/linux/end_signals.h"

enum { EXIT_OK = 0, EXIT_USAGE = 2, EXIT_BUS = 4 };

#define BITRATE_DEFAULT 1000000u

static const char help[] =
    "usage: hodograph-hub [--time real|virtual] [--bitrate N] [--speed X] PATH...\n"
    "\n"
    "A CAN bus at each PATH for processes of this machine, until SIGTERM or SIGINT: --bus PATH of "
    "hodograph-controller,\n"
    "hodograph-drive, hodograph-injector and hodograph-bridge, --bus local:PATH of hodograph. The "
    "kernel need not have CAN.\n"
    "\n"
    "  --time real     (default) frames are passed on as they come\n"
    "  --time virtual  the processes run in one virtual time: what they do depends on their inputs "
    "alone, not on the load\n"
    "                  of this machine (docs/reference/virtual-time.md)\n"
    "  --bitrate N     of the buses in virtual time, bit/s; default 1000000\n"
    "  --speed X       virtual time goes on at most X times as fast as real time; default: as fast "
    "as it can\n"
    "\n"
    "Exit status: 0 ended as asked, 2 wrong usage, 4 no bus can be made at a PATH.\n";

static int wrong(const char *what, const char *value)
{
    (void)fprintf(stderr, "hodograph-hub: %s '%s' (see --help)\n", what, value);
    return EXIT_USAGE;
}

/* Above the simulated drives (20), if permitted: a real bus does not wait for a process. */
static void request_priority(void)
{
    const struct sched_param priority = {.sched_priority = 25};
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
}

static void remove_paths(char **paths, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        (void)unlink(paths[i]);
    }
}

static int serve(char **paths, size_t count, struct hub_options options)
{
    static struct hub hub;
    size_t failed = 0;
    const int end = end_signals_open();
    const int error = hub_open(&hub, (const char *const *)paths, count, options, &failed);
    if (error != 0 || end < 0) {
        (void)fprintf(stderr, "hodograph-hub: no bus at %s: %s\n", paths[failed], strerror(-error));
        remove_paths(paths, failed);
        return EXIT_BUS;
    }
    if (!options.is_virtual) {
        request_priority();
    }
    while (hub_step(&hub, end)) {
    }
    hub_close(&hub);
    remove_paths(paths, count);
    if (hub.lost > 0u) {
        (void)fprintf(stderr,
                      "hodograph-hub: %" PRIu64
                      " frames were lost by members that did not take them\n",
                      hub.lost);
    }
    return EXIT_OK;
}

static bool read_number(const char *text, double least, double most, double *value)
{
    char *end = NULL;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && *value >= least && *value <= most;
}

static int check_paths(char **paths, int count)
{
    if (count < 1 || count > (int)HUB_BUSES) {
        return wrong("give it one to four paths with a '/' in each, not",
                     count < 1 ? "none" : paths[HUB_BUSES]);
    }
    for (int i = 0; i < count; ++i) {
        if (strchr(paths[i], '/') == NULL) {
            return wrong("a path needs a '/', unlike", paths[i]);
        }
    }
    return EXIT_OK;
}

int main(int argc, char **argv)
{
    static const struct option known[] = {{"help", no_argument, NULL, 'h'},
                                          {"time", required_argument, NULL, 't'},
                                          {"bitrate", required_argument, NULL, 'b'},
                                          {"speed", required_argument, NULL, 's'},
                                          {NULL, 0, NULL, 0}};
    struct hub_options options = {.is_virtual = false, .bitrate = BITRATE_DEFAULT, .speed = 0.0};
    double bitrate = BITRATE_DEFAULT;
    for (int option = 0; option >= 0;) {
        option = getopt_long(argc, argv, "", known, NULL);
        if (option == 'h') {
            (void)fputs(help, stdout);
            return EXIT_OK;
        }
        if (option == '?') {
            return EXIT_USAGE;
        }
        if (option == 't') {
            options.is_virtual = strcmp(optarg, "virtual") == 0;
            if (!options.is_virtual && strcmp(optarg, "real") != 0) {
                return wrong("--time takes real or virtual, not", optarg);
            }
        }
        if (option == 'b' && !read_number(optarg, 1e4, 1e9, &bitrate)) {
            return wrong("--bitrate takes bits per second from 10000 on, not", optarg);
        }
        if (option == 's' && !read_number(optarg, 1e-3, 1e6, &options.speed)) {
            return wrong("--speed takes a number from 0.001 on, not", optarg);
        }
    }
    options.bitrate = (uint32_t)bitrate;
    const int status = check_paths(argv + optind, argc - optind);
    return status != EXIT_OK ? status : serve(argv + optind, (size_t)(argc - optind), options);
}
