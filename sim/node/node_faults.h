/* SPDX-License-Identifier: MIT */
/* node_faults: faults injected into simulated drives: carries out the fault rules that are about drives
 * (docs/reference/protocol.md section 4) on the drives of this process.
 *
 * Each rule is independent of the others. A fault lasts until its rule ends, also over a restart of the drive: a broken
 * encoder stays broken. Used by node/drives. All in one context, that of drive_node_receive, between two frames.
 * Changes its struct and the drives, and reports each fault to the caller's function; no I/O of its own. */
#ifndef NODE_NODE_FAULTS_H
#define NODE_NODE_FAULTS_H

#include "faults/fault_rules.h"
#include "faults/fault_trigger.h"
#include "node/drive_node.h"

/* A rule begins or ends. */
typedef void node_faults_note(const struct fault_rule *rule, uint64_t now_ns, int64_t tick,
                              bool on);

struct node_faults {
    const struct fault_rules *rules;
    struct fault_trigger triggers[FAULT_RULES_MAX]; /* by rule; not used: the injector's */
    bool acts[FAULT_RULES_MAX];
    struct fault_ticks ticks;
    struct drive_node *nodes; /* borrowed */
    size_t node_count;
    node_faults_note *note;
};

/* `rules` and `nodes` are borrowed; rules for other nodes have no effect, but are noted as well. */
void node_faults_init(struct node_faults *faults, const struct fault_rules *rules,
                      struct drive_node *nodes, size_t node_count, node_faults_note *note);

/* A frame of the bus, before the drives get it. `now_ns` is above 0. */
void node_faults_receive(struct node_faults *faults, const struct can_msg *in, uint64_t now_ns);

/* Lets wall time pass: ends faults whose duration is given in ms. */
void node_faults_process(struct node_faults *faults, uint64_t now_ns);

/* Begins (on) or ends the fault of one rule, which is about drives, on one drive; fault_rules_parse has checked its
 * figures:
 *     stop             on: no power: sends and receives nothing, the axis is on its brake. Off: the drive boots
 *     restart          on: power lost and back at once
 *     heartbeat-stop   sends no heartbeats
 *     encoder-freeze   the position read stays as it is now. Off: the true one again
 *     encoder-jump     bus counts, added to the position read. Off: subtracted again
 *     encoder-fault    the drive detects that its encoder fails: EMCY 0x7305. Off: a fault reset has effect again
 *     saturate         the voltage limit, V; below a tenth of the drive's own the supply has failed: EMCY 0x3220
 *     load             load torque as the voltage that it takes, V; positive pushes in the negative direction
 *     limit-switch     the input of this switch comes on. Off: the switch itself decides again
 *     fault            on: to Fault with this EMCY code */
void node_faults_carry_out(struct drive_node *node, const struct fault_rule *rule, bool on);

#endif
