/* SPDX-License-Identifier: MIT */
#include "bridge/bridge_options.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

const char bridge_options_help[] =
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

static enum bridge_options_result wrong(struct reason reason, const char *what, const char *name)
{
    (void)snprintf(reason.text, reason.size, "%s %s (see --help)", what, name);
    return BRIDGE_OPTIONS_WRONG;
}

static const char **place_of(struct bridge_options *options, const char *name)
{
    if (strcmp(name, "--bus") == 0) {
        return &options->bus;
    }
    if (strcmp(name, "--out") == 0) {
        return &options->out;
    }
    if (strcmp(name, "--in") == 0) {
        return &options->in;
    }
    return strcmp(name, "--slcan") == 0 ? &options->slcan : NULL;
}

static enum bridge_options_result check(const struct bridge_options *options, struct reason reason)
{
    const bool fifos = options->out != NULL && options->in != NULL;
    const bool any_fifo = options->out != NULL || options->in != NULL;
    if (options->bus == NULL) {
        return wrong(reason, "name the CAN interface behind", "--bus");
    }
    if (options->slcan != NULL ? any_fifo : !fifos) {
        return wrong(reason, "either two FIFOs are needed, --out and --in, or", "--slcan");
    }
    return BRIDGE_OPTIONS_OK;
}

enum bridge_options_result bridge_options_parse(struct bridge_options *options, int argc,
                                                char **argv, char *reason_text, size_t size)
{
    const struct reason reason = {reason_text, size};
    memset(options, 0, sizeof *options);
    for (int i = 1; i < argc; i += 2) {
        if (strcmp(argv[i], "--help") == 0) {
            return BRIDGE_OPTIONS_HELP;
        }
        const char **place = place_of(options, argv[i]);
        if (place == NULL) {
            return wrong(reason, "unknown option", argv[i]);
        }
        if (i + 1 >= argc) {
            return wrong(reason, "a value must follow the option", argv[i]);
        }
        *place = argv[i + 1];
    }
    return check(options, reason);
}
