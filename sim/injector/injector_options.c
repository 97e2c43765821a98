/* SPDX-License-Identifier: MIT */
/* Implements injector/injector_options.h (see there): the command line of hodograph-injector. Used by injector/main.
 * Main thread, once; prints nothing. */
#include "injector/injector_options.h"

#include <string.h>

#include "port/linux/long_options.h"

const char injector_options_help[] =
    "usage: hodograph-injector --bus CONTROLLER --bus DRIVES [--rules FILE] [--verbose]\n"
    "\n"
    "Passes every frame between two CAN buses, and injects the faults of fault rules.\n"
    "\n"
    "  --bus INTERFACE  twice: first the controller's bus, then the drives'\n"
    "  --rules FILE     fault rules, one a line (docs/reference/protocol.md section 4)\n"
    "  --verbose        print what was injected when, one JSON object a line\n"
    "\n"
    "SIGTERM or SIGINT ends it. Exit status: 0 ended as asked, 2 wrong usage, 4 bus not usable.\n";

static enum injector_options_result check(const struct injector_options *options,
                                          const struct long_options *line)
{
    if (options->bus[1] == NULL) {
        (void)long_options_wrong(line, "two buses are needed, each after", "--bus");
        return INJECTOR_OPTIONS_WRONG;
    }
    if (strcmp(options->bus[0], options->bus[1]) == 0) {
        (void)long_options_wrong(line, "two different buses are needed, not twice",
                                 options->bus[0]);
        return INJECTOR_OPTIONS_WRONG;
    }
    return INJECTOR_OPTIONS_OK;
}

enum injector_options_result injector_options_parse(struct injector_options *options, int argc,
                                                    char **argv, char *reason, size_t size)
{
    static const struct option known[] = {{"help", no_argument, NULL, 'h'},
                                          {"bus", required_argument, NULL, 'b'},
                                          {"rules", required_argument, NULL, 'r'},
                                          {"verbose", no_argument, NULL, 'v'},
                                          {NULL, 0, NULL, 0}};
    struct long_options line = long_options_begin(argc, argv, known, reason, size);
    memset(options, 0, sizeof *options);
    for (;;) {
        switch (long_options_next(&line)) {
        case LONG_OPTIONS_END:
            return check(options, &line);
        case 'h':
            return INJECTOR_OPTIONS_HELP;
        case 'v':
            options->verbose = true;
            break;
        case 'r':
            options->rules = line.value;
            break;
        case 'b':
            if (options->bus[1] != NULL) {
                (void)long_options_wrong(&line, "two buses are enough, not a third", line.value);
                return INJECTOR_OPTIONS_WRONG;
            }
            options->bus[options->bus[0] != NULL ? 1 : 0] = line.value;
            break;
        default:
            return INJECTOR_OPTIONS_WRONG;
        }
    }
}
