/* SPDX-License-Identifier: MIT */
/* Implements injector/forwarder.h (see there): passes every frame between the controller's bus and the drives', and
 * injects the faults of the fault rules. Used by injector/main. No I/O, no heap. All functions in one thread. */
#include "injector/forwarder.h"

#include <string.h>

/* A frame that waits for its successor, to be reordered, is sent after this time. */
enum { HOLD_NS = 20000000 };

/* The effect of the rules on one frame. */
struct verdict {
    struct can_msg frame;
    uint32_t copies;
    uint32_t delay_us; /* 0: at once */
    bool hold;
};

void forwarder_init(struct forwarder *forwarder, const struct fault_rules *rules,
                    struct forwarder_port port)
{
    memset(forwarder, 0, sizeof *forwarder);
    forwarder->port = port;
    fault_ticks_init(&forwarder->ticks);
    for (uint32_t i = 0; i < rules->count; i++) {
        if (!fault_kind_is_drives(rules->rules[i].kind)) {
            fault_trigger_init(&forwarder->triggers[forwarder->count++], &rules->rules[i]);
        }
    }
}

static enum fault_side other(enum fault_side side)
{
    return side == FAULT_SIDE_CONTROLLER ? FAULT_SIDE_DRIVES : FAULT_SIDE_CONTROLLER;
}

/* As the rules are at `forwarder->now_ns`. */
static bool is_off(struct forwarder *forwarder, enum fault_side side)
{
    for (uint32_t i = 0; i < forwarder->count; i++) {
        struct fault_trigger *trigger = &forwarder->triggers[i];
        if (trigger->rule->kind == FAULT_KIND_BUS_OFF && trigger->rule->side == side &&
            fault_trigger_acts(trigger, forwarder->ticks.tick, forwarder->now_ns)) {
            return true;
        }
    }
    return false;
}

/* Sends from one side to the other; nothing while one of them is off. */
static void send(struct forwarder *forwarder, enum fault_side to, const struct can_msg *frame)
{
    if (!is_off(forwarder, FAULT_SIDE_CONTROLLER) && !is_off(forwarder, FAULT_SIDE_DRIVES)) {
        forwarder->port.send(forwarder->port.context, to, frame);
    }
}

/* The later frame overtakes the one that waited for it. */
static void pass_on(struct forwarder *forwarder, enum fault_side from, const struct can_msg *frame)
{
    struct forwarder_held *held = &forwarder->held[from];
    send(forwarder, other(from), frame);
    if (held->waits) {
        held->waits = false;
        send(forwarder, other(from), &held->frame);
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

static void judge(struct forwarder *forwarder, enum fault_side from, struct verdict *verdict,
                  uint64_t now_ns)
{
    const struct can_msg before = verdict->frame;
    for (uint32_t i = 0; i < forwarder->count; i++) {
        struct fault_trigger *trigger = &forwarder->triggers[i];
        if (!fault_trigger_acts(trigger, forwarder->ticks.tick, now_ns)) {
            continue;
        }
        const enum fault_kind kind = trigger->rule->kind;
        if (kind != FAULT_KIND_BUS_OFF && kind != FAULT_KIND_FLOOD &&
            fault_trigger_takes(trigger, &before)) {
            apply(trigger->rule, verdict);
            forwarder->port.note(forwarder->port.context, trigger, from, &before, true);
        }
    }
}

static void deliver(struct forwarder *forwarder, enum fault_side from,
                    const struct verdict *verdict, uint64_t now_ns)
{
    struct forwarder_held *held = &forwarder->held[from];
    for (uint32_t i = 0; i < verdict->copies; i++) {
        const uint64_t due_ns = now_ns + 1000ull * verdict->delay_us;
        if (verdict->delay_us != 0u &&
            delay_queue_put(&forwarder->delayed, other(from), &verdict->frame, due_ns)) {
            continue;
        }
        if (verdict->hold && !held->waits) {
            *held = (struct forwarder_held){verdict->frame, now_ns, true};
        } else {
            pass_on(forwarder, from, &verdict->frame);
        }
    }
}

/* Other traffic: eight bytes that identify the frame. Both sides receive it, except a side that is off. */
static void flood(struct forwarder *forwarder, struct fault_trigger *trigger)
{
    const bool receives[2] = {!is_off(forwarder, FAULT_SIDE_CONTROLLER),
                              !is_off(forwarder, FAULT_SIDE_DRIVES)};
    for (uint32_t i = 0; i < trigger->rule->per_tick; i++) {
        struct can_msg frame = {.id = trigger->rule->id, .len = 8};
        const uint32_t number = trigger->used++;
        memcpy(frame.data, &number, sizeof number);
        for (unsigned side = 0; side < 2u; side++) {
            if (receives[side]) {
                forwarder->port.send(forwarder->port.context, (enum fault_side)side, &frame);
            }
        }
    }
}

/* Rules that act for a time and not on a frame. */
static void follow_states(struct forwarder *forwarder, uint64_t now_ns, bool tick_begins)
{
    for (uint32_t i = 0; i < forwarder->count; i++) {
        struct fault_trigger *trigger = &forwarder->triggers[i];
        const enum fault_kind kind = trigger->rule->kind;
        const bool acts = fault_trigger_acts(trigger, forwarder->ticks.tick, now_ns);
        if (kind != FAULT_KIND_FLOOD && kind != FAULT_KIND_BUS_OFF) {
            continue;
        }
        if (acts != forwarder->acts[i]) {
            forwarder->acts[i] = acts;
            forwarder->port.note(forwarder->port.context, trigger, FAULT_SIDE_CONTROLLER, NULL,
                                 acts);
        }
        if (acts && kind == FAULT_KIND_FLOOD && tick_begins) {
            flood(forwarder, trigger);
        }
    }
}

void forwarder_receive(struct forwarder *forwarder, enum fault_side from,
                       const struct can_msg *frame, uint64_t now_ns)
{
    struct verdict verdict = {.frame = *frame, .copies = 1};
    forwarder->now_ns = now_ns;
    const bool tick_begins =
        from == FAULT_SIDE_CONTROLLER && fault_ticks_receive(&forwarder->ticks, frame);
    judge(forwarder, from, &verdict, now_ns);
    deliver(forwarder, from, &verdict, now_ns);
    follow_states(forwarder, now_ns, tick_begins);
}

uint64_t forwarder_due_ns(const struct forwarder *forwarder)
{
    uint64_t due_ns = delay_queue_due_ns(&forwarder->delayed);
    for (unsigned side = 0; side < 2u; side++) {
        const uint64_t limit_ns = forwarder->held[side].since_ns + HOLD_NS;
        if (forwarder->held[side].waits && limit_ns < due_ns) {
            due_ns = limit_ns;
        }
    }
    for (uint32_t i = 0; i < forwarder->count; i++) {
        const uint64_t end_ns =
            forwarder->acts[i] ? fault_trigger_end_ns(&forwarder->triggers[i]) : UINT64_MAX;
        due_ns = end_ns < due_ns ? end_ns : due_ns;
    }
    return due_ns;
}

void forwarder_process(struct forwarder *forwarder, uint64_t now_ns)
{
    struct delayed_frame late;
    forwarder->now_ns = now_ns;
    while (delay_queue_take(&forwarder->delayed, now_ns, &late)) {
        send(forwarder, late.to, &late.frame);
    }
    for (unsigned side = 0; side < 2u; side++) {
        struct forwarder_held *held = &forwarder->held[side];
        if (held->waits && now_ns >= held->since_ns + HOLD_NS) {
            held->waits = false;
            send(forwarder, other((enum fault_side)side), &held->frame);
        }
    }
    follow_states(forwarder, now_ns, false);
}
