/* SPDX-License-Identifier: MIT */
/* bridge_options: the command line of hodograph-bridge. */
#ifndef BRIDGE_BRIDGE_OPTIONS_H
#define BRIDGE_BRIDGE_OPTIONS_H

#include <stddef.h>

struct bridge_options { /* all into argv */
    const char *bus;
    const char *out; /* both NULL where `slcan` is not */
    const char *in;
    const char *slcan;
};

enum bridge_options_result {
    BRIDGE_OPTIONS_OK,
    BRIDGE_OPTIONS_HELP, /* print bridge_options_help */
    BRIDGE_OPTIONS_WRONG /* `reason` has one line that says what and what to do */
};

extern const char bridge_options_help[];

enum bridge_options_result bridge_options_parse(struct bridge_options *options, int argc,
                                                char **argv, char *reason, size_t size);

#endif
