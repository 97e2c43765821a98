/* SPDX-License-Identifier: MIT */
/* drive_od: the behaviour of the object dictionary of a simulated drive; its table is generated from drive.eds. Values
 * that follow from the model, checks of writes, effects of writes. One row for each object that has a handler. Used by
 * node/drive_node. All in one context. Changes the node that it is given; no I/O.
 */
#ifndef NODE_DRIVE_OD_H
#define NODE_DRIVE_OD_H

#include "node/drive_state.h"

/* Their context is a struct drive_node. */
extern const struct od_hooks drive_od_hooks;

/* Values that follow from model, equipment and node number, after defaults have been set. */
void drive_od_fill(struct drive_node *node);

/* Communication objects (0x1000 ... 0x1FFF) to their defaults. */
void drive_od_reset_communication(struct drive_node *node);

#endif
