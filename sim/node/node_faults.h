/* SPDX-License-Identifier: MIT */
/* node_faults: carries out the fault rules that are about drives (docs/reference/protocol.md section 4) on
 * the drives of this process. */
#ifndef NODE_NODE_FAULTS_H
#define NODE_NODE_FAULTS_H

#include "faults/fault_rule.h"
#include "faults/fault_watch.h"
#include "faults/tick_count.h"
#include "node/drive_node.h"

/* A rule begins or ends. */
typedef void node_faults_note(const struct fault_rule *rule, uint64_t now_ns, int64_t tick,
                              bool on);

struct node_faults {
    const struct fault_rules *rules;
    struct fault_watch watches[FAULT_RULES_MAX]; /* by rule; those of the injector are not used */
    bool acts[FAULT_RULES_MAX];
    struct tick_count ticks;
    struct drive_node *nodes; /* borrowed */
    size_t node_count;
    node_faults_note *note;
};

/* `rules` and `nodes` are borrowed; rules about other nodes do nothing, but are noted too. */
void node_faults_init(struct node_faults *faults, const struct fault_rules *rules,
                      struct drive_node *nodes, size_t node_count, node_faults_note *note);

/* A frame of the bus, before the drives get it. `now_ns` is above 0. */
void node_faults_receive(struct node_faults *faults, const struct can_msg *in, uint64_t now_ns);

/* Wall time passes: what lasts for ms ends. */
void node_faults_process(struct node_faults *faults, uint64_t now_ns);

#endif
