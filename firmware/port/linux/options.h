/* SPDX-License-Identifier: MIT */
/* options: reads the command line of hodograph-controller, the controller as a Linux program. Used by port_linux.c.
 * Main thread, once, at the start; prints help to stdout and errors to stderr. */
#ifndef PORT_LINUX_OPTIONS_H
#define PORT_LINUX_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum options_pace {
    OPTIONS_REAL_TIME, /* a tick every period of the wall clock */
    OPTIONS_FAST,      /* fast pace: the next tick as soon as the drives have answered */
};

struct options {
    const char *bus;   /* CAN interface, or path of a local bus; points into argv */
    const char *store; /* file of the program store, points into argv; NULL: memory only */
    uint32_t ring_kib; /* RAM for streamed jobs: 1 ... 16384 */
    uint8_t node;      /* 1 ... 127 */
    enum options_pace pace;
    bool verbose;
    bool no_realtime; /* real drives may be enabled without real-time permission */
};

enum options_result {
    OPTIONS_OK,
    OPTIONS_HELP,  /* --help: the text has been printed */
    OPTIONS_WRONG, /* one line on stderr has the reason */
};

/* Fills *options: those that are not given have their defaults. */
enum options_result options_parse(struct options *options, int argc, char **argv);

#endif
