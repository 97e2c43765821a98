/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "port/linux/options.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "usage: hodograph-controller --bus INTERFACE [--node N] [--pace real-time|fast] [--store "
    "FILE] [--no-realtime]\n"
    "                            [--verbose]\n"
    "\n"
    "The Hodograph motion controller as a CANopen node on a SocketCAN bus. All configuration comes "
    "over the bus\n"
    "(SDO to the node). SIGTERM or SIGINT stops the axes along the path, switches the drives off "
    "and ends.\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as vcan0 or can0\n"
    "  --node N         node number of the controller, 1 to 127; default 1\n"
    "  --pace PACE      real-time (default): one tick every period of the clock.\n"
    "                   fast: while axes move, the next tick as soon as all drives have answered "
    "(simulated drives)\n"
    "  --store FILE     keep the program and the stored parameters in FILE, as a board keeps them "
    "over "
    "a loss of power;\n"
    "                   made where it is missing, some kilobytes on disk; without it both end with "
    "the "
    "process\n"
    "  --no-realtime    enables real drives although the machine does not permit SCHED_FIFO and "
    "locked memory:\n"
    "                   ticks may come late, and a late SYNC is a fault\n"
    "  --verbose        notes about states on stderr\n"
    "\n"
    "exit status: 0 ended as asked, 1 the machine failed (a line says how), 2 wrong usage, 4 bus "
    "not usable,\n"
    "             6 the axes did not stop or the drives did not switch off in time\n";

static enum options_result wrong(const char *what, const char *value)
{
    (void)fprintf(stderr, "hodograph-controller: %s '%s' (see --help)\n", what, value);
    return OPTIONS_WRONG;
}

static enum options_result set_node(struct options *options, const char *value)
{
    char *end = NULL;
    const long node = strtol(value, &end, 10);
    if (end == value || *end != '\0' || node < 1 || node > 127) {
        return wrong("--node takes a number from 1 to 127, not", value);
    }
    options->node = (uint8_t)node;
    return OPTIONS_OK;
}

static enum options_result set_pace(struct options *options, const char *value)
{
    if (strcmp(value, "real-time") == 0) {
        options->pace = OPTIONS_REAL_TIME;
    } else if (strcmp(value, "fast") == 0) {
        options->pace = OPTIONS_FAST;
    } else {
        return wrong("--pace takes real-time or fast, not", value);
    }
    return OPTIONS_OK;
}

enum options_result options_parse(struct options *options, int argc, char **argv)
{
    static const struct option known[] = {
        {"help", no_argument, NULL, 'h'},        {"bus", required_argument, NULL, 'b'},
        {"node", required_argument, NULL, 'n'},  {"pace", required_argument, NULL, 'p'},
        {"store", required_argument, NULL, 's'}, {"no-realtime", no_argument, NULL, 'r'},
        {"verbose", no_argument, NULL, 'v'},     {NULL, 0, NULL, 0}};
    *options = (struct options){.bus = NULL, .store = NULL, .node = 1, .pace = OPTIONS_REAL_TIME};
    enum options_result result = OPTIONS_OK;
    optind = 0; /* from the start, in a second call too */
    while (result == OPTIONS_OK) {
        const int at = optind > 0 ? optind : 1;
        switch (getopt_long(argc, argv, "+:", known, NULL)) {
        case -1:
            if (optind < argc) {
                return wrong("unknown argument", argv[optind]);
            }
            return options->bus != NULL ? OPTIONS_OK
                                        : wrong("name the CAN interface with", "--bus");
        case 'h':
            (void)fputs(help, stdout);
            return OPTIONS_HELP;
        case 'b':
            options->bus = optarg;
            break;
        case 'n':
            result = set_node(options, optarg);
            break;
        case 'p':
            result = set_pace(options, optarg);
            break;
        case 's':
            options->store = optarg;
            break;
        case 'r':
            options->no_realtime = true;
            break;
        case 'v':
            options->verbose = true;
            break;
        case ':':
            return wrong("a value is missing after", argv[at]);
        default:
            return wrong("unknown argument", argv[at]);
        }
    }
    return result;
}
