/* SPDX-License-Identifier: MIT */
#include "injector/injector_options.h"

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

static enum injector_options_result set_value(struct injector_options *options, const char *name,
                                              const char *value, struct reason reason)
{
    const bool bus = strcmp(name, "--bus") == 0;
    if (!bus && strcmp(name, "--rules") != 0) {
        return wrong(reason, "unknown option", name);
    }
    if (value == NULL) {
        return wrong(reason, "a value must follow the option", name);
    }
    if (!bus) {
        options->rules = value;
        return INJECTOR_OPTIONS_OK;
    }
    if (options->bus[1] != NULL) {
        return wrong(reason, "two buses are enough, not a third", value);
    }
    options->bus[options->bus[0] != NULL ? 1 : 0] = value;
    return INJECTOR_OPTIONS_OK;
}

enum injector_options_result injector_options_parse(struct injector_options *options, int argc,
                                                    char **argv, char *reason_text, size_t size)
{
    const struct reason reason = {reason_text, size};
    memset(options, 0, sizeof *options);
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0) {
            return INJECTOR_OPTIONS_HELP;
        }
        if (strcmp(argv[i], "--verbose") == 0) {
            options->verbose = true;
            continue;
        }
        const char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (set_value(options, argv[i], value, reason) != INJECTOR_OPTIONS_OK) {
            return INJECTOR_OPTIONS_WRONG;
        }
        i++;
    }
    if (options->bus[1] == NULL) {
        return wrong(reason, "two buses are needed, each behind", "--bus");
    }
    if (strcmp(options->bus[0], options->bus[1]) == 0) {
        return wrong(reason, "two different buses are needed, not twice", options->bus[0]);
    }
    return INJECTOR_OPTIONS_OK;
}
