/* SPDX-License-Identifier: MIT */
/* node_options: reads the command line of hodograph-drive. Called by node/main. Main thread, once; prints nothing. */
#ifndef NODE_NODE_OPTIONS_H
#define NODE_NODE_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "node/equipment.h"
#include "plant/drive.h"

#define NODE_OPTIONS_AXES 6

struct node_options_axis {
    struct drive_config config; /* SYNC period: 1000 us */
    double position_mm;
    struct equipment equipment;
    uint8_t node;
};

struct node_options {
    const char *bus;    /* points into argv */
    const char *faults; /* a file of fault rules, into argv; NULL: none */
    uint8_t module;     /* node number of an I/O module; 0: none */
    size_t axis_count;
    struct node_options_axis axes[NODE_OPTIONS_AXES];
};

enum node_options_result {
    NODE_OPTIONS_OK,
    NODE_OPTIONS_HELP, /* help requested: print node_options_help */
    NODE_OPTIONS_WRONG /* `reason` has one line: the error and its remedy */
};

extern const char node_options_help[];

/* Reads the command line. Checks form, ranges of the whole numbers, and that no node appears twice;
 * the figures of a drive are checked by drive_init. */
enum node_options_result node_options_parse(struct node_options *options, int argc, char **argv,
                                            char *reason, size_t size);

#endif
