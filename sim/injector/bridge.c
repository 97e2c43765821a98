/* SPDX-License-Identifier: MIT */
#include "injector/bridge.h"

#include <string.h>

enum { HOLD_NS = 20000000 };

/* What the rules make of one frame. */
struct verdict {
    struct can_msg frame;
    uint32_t copies;
    uint32_t delay_us; /* 0: at once */
    bool hold;
};

void bridge_init(struct bridge *bridge, const struct fault_rules *rules, struct bridge_port port)
{
    memset(bridge, 0, sizeof *bridge);
    bridge->port = port;
    tick_count_init(&bridge->ticks);
    for (uint32_t i = 0; i < rules->count; i++) {
        if (!fault_kind_is_drives(rules->rules[i].kind)) {
            fault_watch_init(&bridge->watches[bridge->count++], &rules->rules[i]);
        }
    }
}

static enum fault_side other(enum fault_side side)
{
    return side == FAULT_SIDE_CONTROLLER ? FAULT_SIDE_DRIVES : FAULT_SIDE_CONTROLLER;
}

/* As the rules are at `bridge->now_ns`. */
static bool is_off(struct bridge *bridge, enum fault_side side)
{
    for (uint32_t i = 0; i < bridge->count; i++) {
        struct fault_watch *watch = &bridge->watches[i];
        if (watch->rule->kind == FAULT_KIND_BUS_OFF && watch->rule->side == side &&
            fault_watch_acts(watch, bridge->ticks.tick, bridge->now_ns)) {
            return true;
        }
    }
    return false;
}

/* From one side to the other: nothing while one of them is off. */
static void send(struct bridge *bridge, enum fault_side to, const struct can_msg *frame)
{
    if (!is_off(bridge, FAULT_SIDE_CONTROLLER) && !is_off(bridge, FAULT_SIDE_DRIVES)) {
        bridge->port.send(bridge->port.context, to, frame);
    }
}

/* The frame behind overtakes the one that waited for it. */
static void pass_on(struct bridge *bridge, enum fault_side from, const struct can_msg *frame)
{
    struct bridge_held *held = &bridge->held[from];
    send(bridge, other(from), frame);
    if (held->waits) {
        held->waits = false;
        send(bridge, other(from), &held->frame);
    }
}

static void apply(const struct fault_rule *rule, struct verdict *verdict)
{
    switch (rule->kind) {
    case FAULT_KIND_DROP:
        verdict->copies = 0;
        break;
    case FAULT_KIND_DUPLICATE:
        verdict->copies++;
        break;
    case FAULT_KIND_DELAY:
        verdict->delay_us = rule->delay_us;
        break;
    case FAULT_KIND_REORDER:
        verdict->hold = true;
        break;
    case FAULT_KIND_CORRUPT:
        verdict->frame.data[rule->byte] ^= rule->byte < verdict->frame.len ? rule->mask : 0u;
        break;
    case FAULT_KIND_SHORT:
        verdict->frame.len = rule->len < verdict->frame.len ? rule->len : verdict->frame.len;
        break;
    default:
        break;
    }
}

static void judge(struct bridge *bridge, enum fault_side from, struct verdict *verdict,
                  uint64_t now_ns)
{
    const struct can_msg before = verdict->frame;
    for (uint32_t i = 0; i < bridge->count; i++) {
        struct fault_watch *watch = &bridge->watches[i];
        if (!fault_watch_acts(watch, bridge->ticks.tick, now_ns)) {
            continue;
        }
        const enum fault_kind kind = watch->rule->kind;
        if (kind != FAULT_KIND_BUS_OFF && kind != FAULT_KIND_FLOOD &&
            fault_watch_takes(watch, &before)) {
            apply(watch->rule, verdict);
            bridge->port.note(bridge->port.context, watch, from, &before, true);
        }
    }
}

static void deliver(struct bridge *bridge, enum fault_side from, const struct verdict *verdict,
                    uint64_t now_ns)
{
    struct bridge_held *held = &bridge->held[from];
    for (uint32_t i = 0; i < verdict->copies; i++) {
        const uint64_t due_ns = now_ns + 1000ull * verdict->delay_us;
        if (verdict->delay_us != 0u &&
            delay_queue_put(&bridge->delayed, other(from), &verdict->frame, due_ns)) {
            continue;
        }
        if (verdict->hold && !held->waits) {
            *held = (struct bridge_held){verdict->frame, now_ns, true};
        } else {
            pass_on(bridge, from, &verdict->frame);
        }
    }
}

/* Other traffic: eight bytes that tell the frames apart. It is on the wire, so only who is off does not hear it. */
static void flood(struct bridge *bridge, struct fault_watch *watch)
{
    const bool heard[2] = {!is_off(bridge, FAULT_SIDE_CONTROLLER),
                           !is_off(bridge, FAULT_SIDE_DRIVES)};
    for (uint32_t i = 0; i < watch->rule->per_tick; i++) {
        struct can_msg frame = {.id = watch->rule->id, .len = 8};
        const uint32_t number = watch->used++;
        memcpy(frame.data, &number, sizeof number);
        for (unsigned side = 0; side < 2u; side++) {
            if (heard[side]) {
                bridge->port.send(bridge->port.context, (enum fault_side)side, &frame);
            }
        }
    }
}

/* Rules that are on for a while and want no frame. */
static void follow_states(struct bridge *bridge, uint64_t now_ns, bool tick_begins)
{
    for (uint32_t i = 0; i < bridge->count; i++) {
        struct fault_watch *watch = &bridge->watches[i];
        const enum fault_kind kind = watch->rule->kind;
        const bool acts = fault_watch_acts(watch, bridge->ticks.tick, now_ns);
        if (kind != FAULT_KIND_FLOOD && kind != FAULT_KIND_BUS_OFF) {
            continue;
        }
        if (acts != bridge->acts[i]) {
            bridge->acts[i] = acts;
            bridge->port.note(bridge->port.context, watch, FAULT_SIDE_CONTROLLER, NULL, acts);
        }
        if (acts && kind == FAULT_KIND_FLOOD && tick_begins) {
            flood(bridge, watch);
        }
    }
}

void bridge_receive(struct bridge *bridge, enum fault_side from, const struct can_msg *frame,
                    uint64_t now_ns)
{
    struct verdict verdict = {.frame = *frame, .copies = 1};
    bridge->now_ns = now_ns;
    const bool tick_begins =
        from == FAULT_SIDE_CONTROLLER && tick_count_receive(&bridge->ticks, frame);
    judge(bridge, from, &verdict, now_ns);
    deliver(bridge, from, &verdict, now_ns);
    follow_states(bridge, now_ns, tick_begins);
}

uint64_t bridge_due_ns(const struct bridge *bridge)
{
    uint64_t due_ns = delay_queue_due_ns(&bridge->delayed);
    for (unsigned side = 0; side < 2u; side++) {
        const uint64_t limit_ns = bridge->held[side].since_ns + HOLD_NS;
        if (bridge->held[side].waits && limit_ns < due_ns) {
            due_ns = limit_ns;
        }
    }
    for (uint32_t i = 0; i < bridge->count; i++) {
        const uint64_t end_ns =
            bridge->acts[i] ? fault_watch_end_ns(&bridge->watches[i]) : UINT64_MAX;
        due_ns = end_ns < due_ns ? end_ns : due_ns;
    }
    return due_ns;
}

void bridge_process(struct bridge *bridge, uint64_t now_ns)
{
    struct delayed_frame late;
    bridge->now_ns = now_ns;
    while (delay_queue_take(&bridge->delayed, now_ns, &late)) {
        send(bridge, late.to, &late.frame);
    }
    for (unsigned side = 0; side < 2u; side++) {
        struct bridge_held *held = &bridge->held[side];
        if (held->waits && now_ns >= held->since_ns + HOLD_NS) {
            held->waits = false;
            send(bridge, other((enum fault_side)side), &held->frame);
        }
    }
    follow_states(bridge, now_ns, false);
}
