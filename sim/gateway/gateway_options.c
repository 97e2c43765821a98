/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "gateway/gateway_options.h"

#include <getopt.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

const char gateway_options_help[] =
    "usage: hodograph-bridge --bus INTERFACE --out FIFO --in FIFO\n"
    "       hodograph-bridge --bus INTERFACE --slcan SOCKET\n"
    "\n"
    "Joins a board, emulated by QEMU or not, to a CAN bus of Linux (docs/guides/target.md). "
    "tools/emulate.py "
    "starts it for you.\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as vcan0, or the path of a hodograph-hub\n"
    "  --out FIFO       what the board writes: the FIFO must be there\n"
    "  --in FIFO        what it reads\n"
    "  --slcan SOCKET   SLCAN instead: a UNIX socket (a path) or HOST:PORT on which somebody "
    "listens,\n"
    "                   or fd:N, a connected socket that the bridge is started with\n"
    "\n"
    "SIGTERM or SIGINT asks the board to stop the axes and to end; a second one ends the bridge at "
    "once.\n"
    "Exit status: 0 ended as asked, 1 the board is gone, 2 wrong usage, 4 bus not usable.\n";

struct reason {
    char *text;
    size_t size;
};

static enum gateway_options_result wrong(struct reason reason, const char *what, const char *name)
{
    (void)snprintf(reason.text, reason.size, "%s %s (see --help)", what, name);
    return GATEWAY_OPTIONS_WRONG;
}

static enum gateway_options_result check(const struct gateway_options *options,
                                         struct reason reason)
{
    const bool fifos = options->out != NULL && options->in != NULL;
    const bool any_fifo = options->out != NULL || options->in != NULL;
    if (options->bus == NULL) {
        return wrong(reason, "name the CAN interface behind", "--bus");
    }
    if (options->slcan != NULL ? any_fifo : !fifos) {
        return wrong(reason, "either two FIFOs are needed, --out and --in, or", "--slcan");
    }
    return GATEWAY_OPTIONS_OK;
}

enum gateway_options_result gateway_options_parse(struct gateway_options *options, int argc,
                                                  char **argv, char *reason_text, size_t size)
{
    static const struct option known[] = {
        {"help", no_argument, NULL, 'h'},        {"bus", required_argument, NULL, 'b'},
        {"out", required_argument, NULL, 'o'},   {"in", required_argument, NULL, 'i'},
        {"slcan", required_argument, NULL, 's'}, {NULL, 0, NULL, 0}};
    const struct reason reason = {reason_text, size};
    memset(options, 0, sizeof *options);
    optind = 0; /* from the start, in a second call too */
    for (;;) {
        const int at = optind > 0 ? optind : 1;
        switch (getopt_long(argc, argv, "+:", known, NULL)) {
        case -1:
            return optind < argc ? wrong(reason, "unknown option", argv[optind])
                                 : check(options, reason);
        case 'h':
            return GATEWAY_OPTIONS_HELP;
        case 'b':
            options->bus = optarg;
            break;
        case 'o':
            options->out = optarg;
            break;
        case 'i':
            options->in = optarg;
            break;
        case 's':
            options->slcan = optarg;
            break;
        case ':':
            return wrong(reason, "a value must follow the option", argv[at]);
        default:
            return wrong(reason, "unknown option", argv[at]);
        }
    }
}
