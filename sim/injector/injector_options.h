/* SPDX-License-Identifier: MIT */
/* injector_options: reads the command line of hodograph-injector. Used by injector/main. Main thread, once; prints
 * nothing. */
#ifndef INJECTOR_INJECTOR_OPTIONS_H
#define INJECTOR_INJECTOR_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

struct injector_options {
    const char *bus[2]; /* the controller's, the drives'; into argv */
    const char *rules;  /* a file; NULL: no faults */
    bool verbose;
};

enum injector_options_result {
    INJECTOR_OPTIONS_OK,
    INJECTOR_OPTIONS_HELP, /* print injector_options_help */
    INJECTOR_OPTIONS_WRONG /* `reason` has one line: the error and its remedy */
};

extern const char injector_options_help[];

enum injector_options_result injector_options_parse(struct injector_options *options, int argc,
                                                    char **argv, char *reason, size_t size);

#endif
