/* SPDX-License-Identifier: MIT */
/* What the two parts of node_options share: the command line, and the value of --axis. */
#ifndef NODE_NODE_OPTIONS_PRIVATE_H
#define NODE_NODE_OPTIONS_PRIVATE_H

#include "node/node_options.h"

struct node_options_reason {
    char *text;
    size_t size;
};

/* One line: what is wrong with `value`. */
enum node_options_result node_options_wrong(struct node_options_reason reason, const char *what,
                                            const char *value);

/* Takes KEY=VALUE,... as another drive; cuts `spec` to pieces. */
enum node_options_result node_options_add_axis(struct node_options *options, char *spec,
                                               struct node_options_reason reason);

#endif
