/* SPDX-License-Identifier: MIT */
/* Implements node/node_faults.h (see there): faults injected into simulated drives. Used by node/drives. All in one
 * context, that of drive_node_receive, between two frames. Changes its struct and the drives, and reports each fault to
 * the caller's function; no I/O of its own. */
#include "node/node_faults.h"

#include <assert.h>
#include <string.h>

/* The supply has failed below this part of the drive's own voltage. */
static const double undervoltage = 0.1;

void node_faults_init(struct node_faults *faults, const struct fault_rules *rules,
                      struct drive_node *nodes, size_t node_count, node_faults_note *note)
{
    memset(faults, 0, sizeof *faults);
    faults->rules = rules;
    faults->nodes = nodes;
    faults->node_count = node_count;
    faults->note = note;
    fault_ticks_init(&faults->ticks);
    for (uint32_t i = 0; i < rules->count; i++) {
        fault_trigger_init(&faults->triggers[i], &rules->rules[i]);
    }
}

static void stop(struct drive_node *node, bool on)
{
    if (on && !node->without_power) {
        cia402_device_init(&node->servo.device);
        node->clock.own_us = 0;
    }
    if (node->without_power && !on) {
        drive_node_power_on(node);
    }
    node->without_power = on;
}

static void saturate(struct drive_node *node, double volts, bool on)
{
    struct servo *servo = &node->servo;
    const double own = servo->axis.config.plant.volts_limit;
    servo->axis.influence.volts_limit = on && volts < own ? volts : own;
    servo->supervision.supply_failed = on && volts < undervoltage * own;
    if (servo->supervision.supply_failed) {
        servo_fail_powerless(servo, EMCY_DC_UNDERVOLTAGE);
    }
}

static void freeze_encoder(struct axis_motion *axis, bool on)
{
    axis->influence.encoder_frozen_mm = influence_read_mm(&axis->influence, &axis->drive);
    axis->influence.encoder_frozen = on;
}

static void jump_encoder(struct drive_node *node, double counts, bool on)
{
    struct axis_motion *axis = &node->servo.axis;
    const double jump_mm = on ? counts * axis->drive.mm_per_count : 0.0;
    axis->influence.encoder_offset_mm += jump_mm - node->encoder_jump_mm;
    node->encoder_jump_mm = jump_mm;
}

static void fail_encoder(struct servo *servo, bool on)
{
    servo->supervision.encoder_failed = on;
    if (on) {
        servo_fail_powerless(servo, EMCY_POSITION_SENSOR_1);
    }
}

static void force_limit_switch(struct servo *servo, enum fault_side side, bool on)
{
    const uint32_t input =
        side == FAULT_SIDE_NEGATIVE ? EQUIPMENT_INPUT_NEGATIVE : EQUIPMENT_INPUT_POSITIVE;
    uint32_t *forced = &servo->supervision.forced_inputs;
    *forced = on ? *forced | input : *forced & ~input;
    servo_refresh_inputs(servo);
}

/* Faults without a duration. */
static void happen(struct drive_node *node, const struct fault_rule *rule)
{
    if (rule->kind == FAULT_KIND_RESTART) {
        drive_node_power_on(node);
    } else {
        servo_fail(&node->servo, rule->code);
    }
}

void node_faults_carry_out(struct drive_node *node, const struct fault_rule *rule, bool on)
{
    struct servo *servo = &node->servo;
    assert(fault_kind_is_drives(rule->kind));
    switch (rule->kind) {
    case FAULT_KIND_HEARTBEAT_STOP:
        node->without_heartbeats = on;
        break;
    case FAULT_KIND_ENCODER_FREEZE:
        freeze_encoder(&servo->axis, on);
        break;
    case FAULT_KIND_ENCODER_JUMP:
        jump_encoder(node, rule->counts, on);
        break;
    case FAULT_KIND_ENCODER_FAULT:
        fail_encoder(servo, on);
        break;
    case FAULT_KIND_SATURATE:
        saturate(node, rule->volts, on);
        break;
    case FAULT_KIND_LOAD:
        servo->axis.influence.load_volts = on ? rule->volts : 0.0;
        break;
    case FAULT_KIND_LIMIT_SWITCH:
        force_limit_switch(servo, rule->side, on);
        break;
    case FAULT_KIND_RESTART:
    case FAULT_KIND_FAULT:
        if (on) {
            happen(node, rule);
        }
        break;
    default:
        stop(node, on);
        break;
    }
}

static void follow(struct node_faults *faults, uint64_t now_ns)
{
    for (uint32_t i = 0; i < faults->rules->count; i++) {
        const struct fault_rule *rule = &faults->rules->rules[i];
        const bool acts = fault_trigger_acts(&faults->triggers[i], faults->ticks.tick, now_ns);
        if (!fault_kind_is_drives(rule->kind) || acts == faults->acts[i]) {
            continue;
        }
        faults->acts[i] = acts;
        for (size_t k = 0; k < faults->node_count; k++) {
            if (faults->nodes[k].id == rule->node) {
                node_faults_carry_out(&faults->nodes[k], rule, acts);
            }
        }
        faults->note(rule, now_ns, faults->ticks.tick, acts);
    }
}

void node_faults_receive(struct node_faults *faults, const struct can_msg *in, uint64_t now_ns)
{
    if (fault_ticks_receive(&faults->ticks, in)) {
        follow(faults, now_ns);
    }
}

void node_faults_process(struct node_faults *faults, uint64_t now_ns)
{
    follow(faults, now_ns);
}
