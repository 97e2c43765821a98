/* SPDX-License-Identifier: MIT */
/* drives: all simulated drives of one process on one bus, with its I/O module. Used by node/main (hodograph-drive).
 *
 * It reads frames from the socket, gives them to the nodes, and sends what they return. All functions in one thread. An
 * error of the bus is stored in `failed`, which the caller checks. Frames for which the interface has no room are lost.
 */
#ifndef NODE_DRIVES_H
#define NODE_DRIVES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "node/drive_node.h"
#include "node/io_module.h"
#include "node/node_faults.h"
#include "node/node_options.h"
#include "port/linux/can_socket.h"

struct drives {
    struct can_socket socket;
    struct drive_node nodes[NODE_OPTIONS_AXES];
    size_t count;
    struct io_module module;   /* id 0: none */
    struct fault_rules rules;  /* set before drives_init; none: all zero */
    struct node_faults faults; /* in use when there are rules */
    int failed;                /* negative errno of the bus, 0: none */
};

#define DRIVES_ERR_EQUIPMENT (-100) /* in addition to enum drive_error */

/* Makes the drives; nothing is sent yet. Returns 0, or DRIVES_ERR_EQUIPMENT or a negative enum
 * drive_error with `*node` the drive whose figures are wrong. */
int drives_init(struct drives *drives, const struct node_options *options, uint8_t *node);

/* Only frames that the drives receive wake the process; again when a drive's PDOs were moved. Returns 0 or a
 * negative errno. */
int drives_filter(struct drives *drives);

/* Passes waiting frames to the drives, a bounded number, so that drives_process is called also in a flood. Returns true
 * if one of them was acyclic (NMT, SDO, heartbeat): call drives_process at once. */
bool drives_receive(struct drives *drives);

/* After a long sleep: if so many frames wait that processing them would take as long again, all are dropped, as by a
 * drive that was switched off. After a stall of the whole computer only a few frames wait, which are kept. */
void drives_wake(struct drives *drives);

/* Lets wall time pass. */
void drives_process(struct drives *drives, uint32_t elapsed_us);

#endif
