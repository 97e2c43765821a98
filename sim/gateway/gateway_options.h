/* SPDX-License-Identifier: MIT */
/* gateway_options: reads the command line of hodograph-bridge. Used by gateway/main. Main thread, once; prints
 * nothing. */
#ifndef GATEWAY_GATEWAY_OPTIONS_H
#define GATEWAY_GATEWAY_OPTIONS_H

#include <stddef.h>

struct gateway_options { /* all into argv */
    const char *bus;
    const char *out; /* `out` and `in` are NULL if `slcan` is given */
    const char *in;
    const char *slcan;
};

enum gateway_options_result {
    GATEWAY_OPTIONS_OK,
    GATEWAY_OPTIONS_HELP, /* print gateway_options_help */
    GATEWAY_OPTIONS_WRONG /* `reason` has one line: the error and its remedy */
};

extern const char gateway_options_help[];

enum gateway_options_result gateway_options_parse(struct gateway_options *options, int argc,
                                                  char **argv, char *reason, size_t size);

#endif
