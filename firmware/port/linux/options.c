/* SPDX-License-Identifier: MIT */
#include "port/linux/options.h"

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

static enum options_result set_valued(struct options *options, const char *name, const char *value)
{
    if (strcmp(name, "--bus") == 0) {
        options->bus = value;
        return OPTIONS_OK;
    }
    if (strcmp(name, "--store") == 0) {
        options->store = value;
        return OPTIONS_OK;
    }
    return strcmp(name, "--node") == 0 ? set_node(options, value) : set_pace(options, value);
}

static bool takes_value(const char *name)
{
    return strcmp(name, "--bus") == 0 || strcmp(name, "--node") == 0 ||
           strcmp(name, "--pace") == 0 || strcmp(name, "--store") == 0;
}

enum options_result options_parse(struct options *options, int argc, char **argv)
{
    *options = (struct options){.bus = NULL, .store = NULL, .node = 1, .pace = OPTIONS_REAL_TIME};
    for (int i = 1; i < argc; ++i) {
        if (strcmp(argv[i], "--help") == 0) {
            (void)fputs(help, stdout);
            return OPTIONS_HELP;
        }
        if (strcmp(argv[i], "--verbose") == 0) {
            options->verbose = true;
        } else if (strcmp(argv[i], "--no-realtime") == 0) {
            options->no_realtime = true;
        } else if (!takes_value(argv[i])) {
            return wrong("unknown argument", argv[i]);
        } else if (i + 1 >= argc) {
            return wrong("a value is missing after", argv[i]);
        } else {
            const enum options_result result = set_valued(options, argv[i], argv[i + 1]);
            if (result != OPTIONS_OK) {
                return result;
            }
            ++i;
        }
    }
    return options->bus != NULL ? OPTIONS_OK : wrong("name the CAN interface with", "--bus");
}
