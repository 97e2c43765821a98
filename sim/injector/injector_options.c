/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "injector/injector_options.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>

const char injector_options_help[] =
    "usage: hodograph-injector --bus CONTROLLER --bus DRIVES [--rules FILE] [--verbose]\n"
    "\n"
    "Stands between two CAN buses, passes every frame on, and does to some what fault rules say.\n"
    "\n"
    "  --bus INTERFACE  twice: first the controller's bus, then the drives'\n"
    "  --rules FILE     fault rules, one a line (docs/reference/protocol.md section 4)\n"
    "  --verbose        print what was injected when, one JSON object a line\n"
    "\n"
    "SIGTERM or SIGINT ends it. Exit status: 0 ended as asked, 2 wrong usage, 4 bus not usable.\n";

struct reason {
    char *text;
    size_t size;
};

static enum injector_options_result wrong(struct reason reason, const char *what, const char *name)
{
    (void)snprintf(reason.text, reason.size, "%s %s (see --help)", what, name);
    return INJECTOR_OPTIONS_WRONG;
}

static enum injector_options_result check(const struct injector_options *options,
                                          struct reason reason)
{
    if (options->bus[1] == NULL) {
        return wrong(reason, "two buses are needed, each behind", "--bus");
    }
    if (strcmp(options->bus[0], options->bus[1]) == 0) {
        return wrong(reason, "two different buses are needed, not twice", options->bus[0]);
    }
    return INJECTOR_OPTIONS_OK;
}

enum injector_options_result injector_options_parse(struct injector_options *options, int argc,
                                                    char **argv, char *reason_text, size_t size)
{
    static const struct option known[] = {{"help", no_argument, NULL, 'h'},
                                          {"bus", required_argument, NULL, 'b'},
                                          {"rules", required_argument, NULL, 'r'},
                                          {"verbose", no_argument, NULL, 'v'},
                                          {NULL, 0, NULL, 0}};
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
            return INJECTOR_OPTIONS_HELP;
        case 'v':
            options->verbose = true;
            break;
        case 'r':
            options->rules = optarg;
            break;
        case 'b':
            if (options->bus[1] != NULL) {
                return wrong(reason, "two buses are enough, not a third", optarg);
            }
            options->bus[options->bus[0] != NULL ? 1 : 0] = optarg;
            break;
        case ':':
            return wrong(reason, "a value must follow the option", argv[at]);
        default:
            return wrong(reason, "unknown option", argv[at]);
        }
    }
}
