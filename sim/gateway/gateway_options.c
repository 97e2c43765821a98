/* SPDX-License-Identifier: MIT */
/* Implements gateway/gateway_options.h (see there): the command line of hodograph-bridge. Used by gateway/main. Main
 * thread, once; prints nothing. */
#include "gateway/gateway_options.h"

#include <stdbool.h>
#include <string.h>

#include "port/linux/long_options.h"

const char gateway_options_help[] =
    "usage: hodograph-bridge --bus INTERFACE --out FIFO --in FIFO\n"
    "       hodograph-bridge --bus INTERFACE --slcan SOCKET\n"
    "\n"
    "Joins a board, emulated by QEMU or not, to a CAN bus of Linux (docs/guides/target.md). "
    "tools/emulate.py "
    "starts it for you.\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as vcan0, or the path of a local bus "
    "(hodograph-hub)\n"
    "  --out FIFO       what the board writes: the FIFO must be there\n"
    "  --in FIFO        what it reads\n"
    "  --slcan SOCKET   SLCAN instead: a UNIX socket (a path) or HOST:PORT on which the board "
    "listens,\n"
    "                   or fd:N, a connected socket that the bridge is started with\n"
    "\n"
    "SIGTERM, SIGINT or SIGHUP asks the board to stop the axes and to end; a second one ends the "
    "bridge at "
    "once.\n"
    "Exit status: 0 ended as asked, 1 the board is gone, 2 wrong usage, 4 bus not usable.\n";

static enum gateway_options_result check(const struct gateway_options *options,
                                         const struct long_options *line)
{
    const bool fifos = options->out != NULL && options->in != NULL;
    const bool any_fifo = options->out != NULL || options->in != NULL;
    if (options->bus == NULL) {
        (void)long_options_wrong(line, "name the CAN interface after", "--bus");
        return GATEWAY_OPTIONS_WRONG;
    }
    if (options->slcan != NULL ? any_fifo : !fifos) {
        (void)long_options_wrong(line, "either two FIFOs are needed, --out and --in, or",
                                 "--slcan");
        return GATEWAY_OPTIONS_WRONG;
    }
    return GATEWAY_OPTIONS_OK;
}

enum gateway_options_result gateway_options_parse(struct gateway_options *options, int argc,
                                                  char **argv, char *reason, size_t size)
{
    static const struct option known[] = {
        {"help", no_argument, NULL, 'h'},        {"bus", required_argument, NULL, 'b'},
        {"out", required_argument, NULL, 'o'},   {"in", required_argument, NULL, 'i'},
        {"slcan", required_argument, NULL, 's'}, {NULL, 0, NULL, 0}};
    struct long_options line = long_options_begin(argc, argv, known, reason, size);
    memset(options, 0, sizeof *options);
    for (;;) {
        switch (long_options_next(&line)) {
        case LONG_OPTIONS_END:
            return check(options, &line);
        case 'h':
            return GATEWAY_OPTIONS_HELP;
        case 'b':
            options->bus = line.value;
            break;
        case 'o':
            options->out = line.value;
            break;
        case 'i':
            options->in = line.value;
            break;
        case 's':
            options->slcan = line.value;
            break;
        default:
            return GATEWAY_OPTIONS_WRONG;
        }
    }
}
