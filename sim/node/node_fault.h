/* SPDX-License-Identifier: MIT */
/* node_fault: what can be done to a simulated drive from outside, for fault scenarios.
 *
 * The kinds are those of docs/reference/protocol.md section 4 that a drive carries out; when they act is the
 * caller's business. Each kind is independent of the others; a kind that is on stays on until it is
 * called off, or the drive begins anew (NODE_FAULT_RESTART ends none of them: a broken encoder stays
 * broken). Same context as drive_node_receive, between two frames.
 */
#ifndef NODE_NODE_FAULT_H
#define NODE_NODE_FAULT_H

#include <stdbool.h>

#include "node/drive_node.h"

enum node_fault {
    NODE_FAULT_STOP,    /* silent: sends and hears nothing, lets go of its motor. Off: the power
                                  is back, the drive boots */
    NODE_FAULT_RESTART, /* on: power lost and back at once; off: nothing */
    NODE_FAULT_HEARTBEAT_STOP, /* sends no heartbeats */
    NODE_FAULT_ENCODER_FREEZE, /* the position read stays as it is now. Off: the true one again */
    NODE_FAULT_ENCODER_JUMP,   /* value: bus counts, added to the position read. Off: taken back */
    NODE_FAULT_ENCODER_FAULT,  /* the drive notices that its encoder fails: EMCY 0x7305. Off: it is
                                  well again, fault reset helps */
    NODE_FAULT_SATURATE,       /* value: the voltage limit, V, more than 0; below a tenth of the
                                  drive's own the supply has failed: EMCY 0x3220. Off: the drive's own */
    NODE_FAULT_LOAD,         /* value: load torque as the voltage that it takes, V; positive pushes
                                  the axis in the negative direction */
    NODE_FAULT_LIMIT_SWITCH, /* value: -1 negative, +1 positive switch: its input comes on. Off:
                                  the switch itself decides again */
    NODE_FAULT_CODE /* on: to Fault with the EMCY code `value` (1 ... 0xFFFF); off: nothing */
};

#define NODE_FAULT_ERR_VALUE (-1) /* not a value of this kind */

/* Begins (on) or ends a fault; `value` counts only where the kind names it, and not when it ends
 * (but for the side of a limit switch). Returns 0 or NODE_FAULT_ERR_VALUE, and then nothing has
 * changed. */
int drive_node_fault(struct drive_node *node, enum node_fault kind, double value, bool on);

#endif
