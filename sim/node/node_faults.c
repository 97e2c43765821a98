/* SPDX-License-Identifier: MIT */
#include "node/node_faults.h"

#include <assert.h>
#include <string.h>

#include "node/node_fault.h"

void node_faults_init(struct node_faults *faults, const struct fault_rules *rules,
                      struct drive_node *nodes, size_t node_count, node_faults_note *note)
{
    memset(faults, 0, sizeof *faults);
    faults->rules = rules;
    faults->nodes = nodes;
    faults->node_count = node_count;
    faults->note = note;
    tick_count_init(&faults->ticks);
    for (uint32_t i = 0; i < rules->count; i++) {
        fault_watch_init(&faults->watches[i], &rules->rules[i]);
    }
}

/* The drive's word for the kind, and its value. */
static enum node_fault translate(const struct fault_rule *rule, double *value)
{
    *value = 0.0;
    switch (rule->kind) {
    case FAULT_KIND_RESTART:
        return NODE_FAULT_RESTART;
    case FAULT_KIND_HEARTBEAT_STOP:
        return NODE_FAULT_HEARTBEAT_STOP;
    case FAULT_KIND_ENCODER_FREEZE:
        return NODE_FAULT_ENCODER_FREEZE;
    case FAULT_KIND_ENCODER_JUMP:
        *value = rule->counts;
        return NODE_FAULT_ENCODER_JUMP;
    case FAULT_KIND_ENCODER_FAULT:
        return NODE_FAULT_ENCODER_FAULT;
    case FAULT_KIND_SATURATE:
        *value = rule->volts;
        return NODE_FAULT_SATURATE;
    case FAULT_KIND_LOAD:
        *value = rule->volts;
        return NODE_FAULT_LOAD;
    case FAULT_KIND_LIMIT_SWITCH:
        *value = rule->side == FAULT_SIDE_NEGATIVE ? -1.0 : 1.0;
        return NODE_FAULT_LIMIT_SWITCH;
    case FAULT_KIND_FAULT:
        *value = rule->code;
        return NODE_FAULT_CODE;
    default:
        return NODE_FAULT_STOP;
    }
}

static void carry_out(struct node_faults *faults, const struct fault_rule *rule, bool on)
{
    double value = 0.0;
    const enum node_fault kind = translate(rule, &value);
    for (size_t i = 0; i < faults->node_count; i++) {
        if (faults->nodes[i].id == rule->node) {
            const int error = drive_node_fault(&faults->nodes[i], kind, value, on);
            assert(error == 0); /* the parser knows the ranges */
            (void)error;
        }
    }
}

static void follow(struct node_faults *faults, uint64_t now_ns)
{
    for (uint32_t i = 0; i < faults->rules->count; i++) {
        const struct fault_rule *rule = &faults->rules->rules[i];
        const bool acts = fault_watch_acts(&faults->watches[i], faults->ticks.tick, now_ns);
        if (!fault_kind_is_drives(rule->kind) || acts == faults->acts[i]) {
            continue;
        }
        faults->acts[i] = acts;
        carry_out(faults, rule, acts);
        faults->note(rule, now_ns, faults->ticks.tick, acts);
    }
}

void node_faults_receive(struct node_faults *faults, const struct can_msg *in, uint64_t now_ns)
{
    if (tick_count_receive(&faults->ticks, in)) {
        follow(faults, now_ns);
    }
}

void node_faults_process(struct node_faults *faults, uint64_t now_ns)
{
    follow(faults, now_ns);
}
