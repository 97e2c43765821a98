/* SPDX-License-Identifier: MIT */
/* Implements port/linux/options.h (see there): the command line of hodograph-controller. Used by port_linux.c. Main
 * thread, once, at the start; prints help to stdout and errors to stderr. */
#include "port/linux/options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "port/linux/long_options.h"

enum { REASON_SIZE = 4096, RING_KIB_MAX = 16384 };

static const char help[] =
    "usage: hodograph-controller --bus INTERFACE [--node N] [--pace real-time|fast] [--store "
    "FILE] [--no-realtime]\n"
    "                            [--ring KIB] [--verbose]\n"
    "\n"
    "The Hodograph motion controller as a CANopen node on a SocketCAN bus. All configuration comes "
    "over the bus\n"
    "(SDO to the node). SIGTERM, SIGINT or SIGHUP stops the axes along the path, switches the "
    "drives off and ends.\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as can0, or the path of a local bus "
    "(hodograph-hub)\n"
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
    "  --ring KIB       RAM for the chunks of a streamed job, 1 to 16384 KiB; default 16384, a "
    "microcontroller has 48\n"
    "  --no-realtime    enables real drives although the machine does not permit SCHED_FIFO and "
    "locked memory:\n"
    "                   ticks may come late, and a late SYNC is a fault\n"
    "  --verbose        notes about states on stderr\n"
    "\n"
    "exit status: 0 ended as asked, 1 the machine failed (a line says how), 2 wrong usage, 4 bus "
    "not usable,\n"
    "             6 the axes did not stop or the drives did not switch off in time\n";

static int set_node(struct options *options, const struct long_options *line)
{
    char *end = NULL;
    const long node = strtol(line->value, &end, 10);
    if (end == line->value || *end != '\0' || node < 1 || node > 127) {
        return long_options_wrong(line, "--node takes a number from 1 to 127, not", line->value);
    }
    options->node = (uint8_t)node;
    return LONG_OPTIONS_END;
}

static int set_ring(struct options *options, const struct long_options *line)
{
    char *end = NULL;
    const long kib = strtol(line->value, &end, 10);
    if (end == line->value || *end != '\0' || kib < 1 || kib > RING_KIB_MAX) {
        return long_options_wrong(line, "--ring takes a number of KiB from 1 to 16384, not",
                                  line->value);
    }
    options->ring_kib = (uint32_t)kib;
    return LONG_OPTIONS_END;
}

static int set_pace(struct options *options, const struct long_options *line)
{
    if (strcmp(line->value, "real-time") == 0) {
        options->pace = OPTIONS_REAL_TIME;
    } else if (strcmp(line->value, "fast") == 0) {
        options->pace = OPTIONS_FAST;
    } else {
        return long_options_wrong(line, "--pace takes real-time or fast, not", line->value);
    }
    return LONG_OPTIONS_END;
}

/* Takes over one option. LONG_OPTIONS_WRONG: its value is. */
static int set_option(struct options *options, int option, const struct long_options *line)
{
    switch (option) {
    case 'b':
        options->bus = line->value;
        break;
    case 'n':
        return set_node(options, line);
    case 'p':
        return set_pace(options, line);
    case 's':
        options->store = line->value;
        break;
    case 'g':
        return set_ring(options, line);
    case 'r':
        options->no_realtime = true;
        break;
    default:
        options->verbose = true;
        break;
    }
    return LONG_OPTIONS_END;
}

static enum options_result complain(const struct long_options *line)
{
    (void)fprintf(stderr, "hodograph-controller: %s\n", line->reason);
    return OPTIONS_WRONG;
}

enum options_result options_parse(struct options *options, int argc, char **argv)
{
    static const struct option known[] = {{"help", no_argument, NULL, 'h'},
                                          {"bus", required_argument, NULL, 'b'},
                                          {"node", required_argument, NULL, 'n'},
                                          {"pace", required_argument, NULL, 'p'},
                                          {"store", required_argument, NULL, 's'},
                                          {"no-realtime", no_argument, NULL, 'r'},
                                          {"verbose", no_argument, NULL, 'v'},
                                          {"ring", required_argument, NULL, 'g'},
                                          {NULL, 0, NULL, 0}};
    char reason[REASON_SIZE];
    struct long_options line = long_options_begin(argc, argv, known, reason, sizeof reason);
    line.quoted = true;
    line.no_value = "a value is missing after";
    line.unknown = "unknown argument";
    *options = (struct options){
        .bus = NULL, .store = NULL, .ring_kib = RING_KIB_MAX, .node = 1, .pace = OPTIONS_REAL_TIME};
    int option = long_options_next(&line);
    while (option > 0 && option != 'h' && set_option(options, option, &line) == LONG_OPTIONS_END) {
        option = long_options_next(&line);
    }
    if (option == 'h') {
        (void)fputs(help, stdout);
        return OPTIONS_HELP;
    }
    if (option == LONG_OPTIONS_END && options->bus == NULL) {
        option = long_options_wrong(&line, "name the CAN interface with", "--bus");
    }
    return option == LONG_OPTIONS_END ? OPTIONS_OK : complain(&line);
}
