/* SPDX-License-Identifier: MIT */
#include "faults/fault_keys.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "faults/fault_value.h"

enum {
    AT = 1 << 0,
    FOR = 1 << 1,
    FOR_MS = 1 << 2,
    COUNT = 1 << 3,
    P = 1 << 4,
    SEED = 1 << 5,
    ID = 1 << 6,
    NODE = 1 << 7,
    US = 1 << 8,
    BYTE = 1 << 9,
    XOR = 1 << 10,
    LEN = 1 << 11,
    PER_TICK = 1 << 12,
    SIDE = 1 << 13,
    COUNTS = 1 << 14,
    VOLTS = 1 << 15,
    CODE = 1 << 16
};

struct key {
    const char *name;
    size_t offset; /* in struct fault_rule */
    double low, high;
    enum fault_field field;
};

#define IN(member) offsetof(struct fault_rule, member)

/* In the order of the bits. An hour of ticks is enough for any scenario. */
static const struct key keys[] = {
    {"at", IN(at), 0, 4e6, FAULT_FIELD_U32},
    {"for", IN(for_ticks), 1, 4e6, FAULT_FIELD_U32},
    {"for_ms", IN(for_ms), 1, 4e6, FAULT_FIELD_U32},
    {"count", IN(count), 1, 4e6, FAULT_FIELD_U32},
    {"p", IN(p), 0, 1, FAULT_FIELD_NUMBER},
    {"seed", IN(seed), 0, 4294967295.0, FAULT_FIELD_U32},
    {"id", IN(id), 0, 0x7FF, FAULT_FIELD_U16},
    {"node", IN(node), 1, 127, FAULT_FIELD_U8},
    {"us", IN(delay_us), 1, 10e6, FAULT_FIELD_U32},
    {"byte", IN(byte), 0, 7, FAULT_FIELD_U8},
    {"xor", IN(mask), 1, 0xFF, FAULT_FIELD_U8},
    {"len", IN(len), 0, 7, FAULT_FIELD_U8},
    {"per_tick", IN(per_tick), 1, 100, FAULT_FIELD_U32},
    {"side", IN(side), 0, 0, FAULT_FIELD_SIDE},
    {"counts", IN(counts), -2147483648.0, 2147483647.0, FAULT_FIELD_I32},
    {"volts", IN(volts), -1000, 1000, FAULT_FIELD_NUMBER},
    {"code", IN(code), 1, 0xFFFF, FAULT_FIELD_U16},
};

enum { KEYS = sizeof keys / sizeof keys[0], TIMES = AT | FOR | FOR_MS };

enum { FRAMES = TIMES | COUNT | P | SEED | ID };

struct needs {
    uint32_t allowed; /* beside the required ones */
    uint32_t required;
};

static const struct needs kinds[FAULT_KINDS] = {
    [FAULT_KIND_DROP] = {FRAMES, AT | ID},
    [FAULT_KIND_DUPLICATE] = {FRAMES, AT | ID},
    [FAULT_KIND_DELAY] = {FRAMES, AT | ID | US},
    [FAULT_KIND_REORDER] = {FRAMES, AT | ID},
    [FAULT_KIND_CORRUPT] = {FRAMES, AT | ID | BYTE | XOR},
    [FAULT_KIND_SHORT] = {FRAMES, AT | ID | LEN},
    [FAULT_KIND_FLOOD] = {TIMES | COUNT, AT | ID | PER_TICK},
    [FAULT_KIND_BUS_OFF] = {TIMES, AT | SIDE},
    [FAULT_KIND_STOP] = {TIMES, AT | NODE},
    [FAULT_KIND_RESTART] = {0, AT | NODE},
    [FAULT_KIND_HEARTBEAT_STOP] = {TIMES, AT | NODE},
    [FAULT_KIND_ENCODER_FREEZE] = {TIMES, AT | NODE},
    [FAULT_KIND_ENCODER_JUMP] = {TIMES, AT | NODE | COUNTS},
    [FAULT_KIND_ENCODER_FAULT] = {TIMES, AT | NODE},
    [FAULT_KIND_SATURATE] = {TIMES, AT | NODE | VOLTS},
    [FAULT_KIND_LOAD] = {TIMES, AT | NODE | VOLTS},
    [FAULT_KIND_LIMIT_SWITCH] = {TIMES, AT | NODE | SIDE},
    [FAULT_KIND_FAULT] = {0, AT | NODE | CODE},
};

uint32_t fault_key_find(const char *name)
{
    for (unsigned i = 0; i < KEYS; i++) {
        if (strcmp(name, keys[i].name) == 0) {
            return 1u << i;
        }
    }
    return 0;
}

static const struct key *key_of(uint32_t key)
{
    unsigned i = 0;
    while (i < KEYS && key != 1u << i) {
        i++;
    }
    assert(i < KEYS);
    return &keys[i];
}

const char *fault_key_name(uint32_t key)
{
    return key_of(key)->name;
}

uint32_t fault_keys_allowed(enum fault_kind kind)
{
    return kinds[kind].allowed | kinds[kind].required;
}

uint32_t fault_keys_required(enum fault_kind kind)
{
    return kinds[kind].required;
}

int fault_keys_settle(struct fault_rule *rule, uint32_t seen)
{
    const uint32_t given = seen & (FOR | FOR_MS);
    if (given == (FOR | FOR_MS)) {
        return -1;
    }
    if (given == FOR_MS) {
        rule->for_ticks = 0;
    } else if (given == 0u) {
        rule->for_ticks = rule->kind == FAULT_KIND_ENCODER_JUMP ? FAULT_FOR_EVER : 1u;
    }
    return 0;
}

/* Each kind has its own two sides: the words of the other kind are refused. */
static bool store_side(struct fault_rule *rule, const char *value)
{
    static const char *const words[] = {"controller", "drives", "negative", "positive"};
    const unsigned first = rule->kind == FAULT_KIND_BUS_OFF ? 0u : 2u;
    for (unsigned i = first; i < first + 2u; i++) {
        if (strcmp(value, words[i]) == 0) {
            rule->side = (enum fault_side)i;
            return true;
        }
    }
    return false;
}

bool fault_key_store(struct fault_rule *rule, uint32_t key, const char *value)
{
    const struct key *it = key_of(key);
    double number = 0.0;
    if (it->field == FAULT_FIELD_SIDE) {
        return store_side(rule, value);
    }
    if (!fault_value_read(value, it->field, &number) || number < it->low || number > it->high) {
        return false;
    }
    if (key == VOLTS && rule->kind == FAULT_KIND_SATURATE && number <= 0.0) {
        return false;
    }
    fault_value_store((unsigned char *)rule + it->offset, it->field, number);
    return true;
}
