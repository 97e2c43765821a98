/* SPDX-License-Identifier: MIT */
/* Implements faults/fault_rules.h (see there): scripted faults, one a line of text. Used by sim/faults, sim/injector
 * and sim/node. Any thread; fault_rules_read reads a file, the other functions change their arguments only. */
#include "faults/fault_rules.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- kinds and keys ---- */

static const char *const names[FAULT_KINDS] = {
    [FAULT_KIND_DROP] = "drop",
    [FAULT_KIND_DUPLICATE] = "duplicate",
    [FAULT_KIND_DELAY] = "delay",
    [FAULT_KIND_REORDER] = "reorder",
    [FAULT_KIND_CORRUPT] = "corrupt",
    [FAULT_KIND_SHORT] = "short",
    [FAULT_KIND_FLOOD] = "flood",
    [FAULT_KIND_BUS_OFF] = "bus-off",
    [FAULT_KIND_STOP] = "stop",
    [FAULT_KIND_RESTART] = "restart",
    [FAULT_KIND_HEARTBEAT_STOP] = "heartbeat-stop",
    [FAULT_KIND_ENCODER_FREEZE] = "encoder-freeze",
    [FAULT_KIND_ENCODER_JUMP] = "encoder-jump",
    [FAULT_KIND_ENCODER_FAULT] = "encoder-fault",
    [FAULT_KIND_SATURATE] = "saturate",
    [FAULT_KIND_LOAD] = "load",
    [FAULT_KIND_LIMIT_SWITCH] = "limit-switch",
    [FAULT_KIND_FAULT] = "fault",
};

const char *fault_kind_name(enum fault_kind kind)
{
    assert(kind < FAULT_KINDS);
    return names[kind];
}

bool fault_kind_is_drives(enum fault_kind kind)
{
    return kind >= FAULT_KIND_STOP;
}

enum key_index {
    KEY_AT,
    KEY_FOR,
    KEY_FOR_MS,
    KEY_COUNT,
    KEY_P,
    KEY_SEED,
    KEY_ID,
    KEY_NODE,
    KEY_US,
    KEY_BYTE,
    KEY_XOR,
    KEY_LEN,
    KEY_PER_TICK,
    KEY_SIDE,
    KEY_COUNTS,
    KEY_VOLTS,
    KEY_CODE,
    KEYS
};

#define BIT(key) (UINT32_C(1) << KEY_##key)

enum field_type {
    FIELD_U8,
    FIELD_U16,
    FIELD_U32,
    FIELD_I32,
    FIELD_NUMBER, /* a double */
    FIELD_SIDE,   /* enum fault_side: a word, no number */
};

struct key {
    const char *name;
    size_t offset; /* in struct fault_rule */
    double low, high;
    enum field_type type;
};

#define IN(member) offsetof(struct fault_rule, member)

/* An hour of ticks is enough for any scenario. */
static const struct key keys[KEYS] = {
    [KEY_AT] = {"at", IN(at), 0, 4e6, FIELD_U32},
    [KEY_FOR] = {"for", IN(for_ticks), 1, 4e6, FIELD_U32},
    [KEY_FOR_MS] = {"for_ms", IN(for_ms), 1, 4e6, FIELD_U32},
    [KEY_COUNT] = {"count", IN(count), 1, 4e6, FIELD_U32},
    [KEY_P] = {"p", IN(p), 0, 1, FIELD_NUMBER},
    [KEY_SEED] = {"seed", IN(seed), 0, 4294967295.0, FIELD_U32},
    [KEY_ID] = {"id", IN(id), 0, 0x7FF, FIELD_U16},
    [KEY_NODE] = {"node", IN(node), 1, 127, FIELD_U8},
    [KEY_US] = {"us", IN(delay_us), 1, 10e6, FIELD_U32},
    [KEY_BYTE] = {"byte", IN(byte), 0, 7, FIELD_U8},
    [KEY_XOR] = {"xor", IN(mask), 1, 0xFF, FIELD_U8},
    [KEY_LEN] = {"len", IN(len), 0, 7, FIELD_U8},
    [KEY_PER_TICK] = {"per_tick", IN(per_tick), 1, 100, FIELD_U32},
    [KEY_SIDE] = {"side", IN(side), 0, 0, FIELD_SIDE},
    [KEY_COUNTS] = {"counts", IN(counts), -2147483648.0, 2147483647.0, FIELD_I32},
    [KEY_VOLTS] = {"volts", IN(volts), -1000, 1000, FIELD_NUMBER},
    [KEY_CODE] = {"code", IN(code), 1, 0xFFFF, FIELD_U16},
};

#define TIMES  (BIT(AT) | BIT(FOR) | BIT(FOR_MS))
#define FRAMES (TIMES | BIT(COUNT) | BIT(P) | BIT(SEED) | BIT(ID))

/* Keys of a kind, as bits. */
struct needs {
    uint32_t allowed; /* in addition to the required ones */
    uint32_t required;
};

static const struct needs kinds[FAULT_KINDS] = {
    [FAULT_KIND_DROP] = {FRAMES, BIT(AT) | BIT(ID)},
    [FAULT_KIND_DUPLICATE] = {FRAMES, BIT(AT) | BIT(ID)},
    [FAULT_KIND_DELAY] = {FRAMES, BIT(AT) | BIT(ID) | BIT(US)},
    [FAULT_KIND_REORDER] = {FRAMES, BIT(AT) | BIT(ID)},
    [FAULT_KIND_CORRUPT] = {FRAMES, BIT(AT) | BIT(ID) | BIT(BYTE) | BIT(XOR)},
    [FAULT_KIND_SHORT] = {FRAMES, BIT(AT) | BIT(ID) | BIT(LEN)},
    [FAULT_KIND_FLOOD] = {TIMES | BIT(COUNT), BIT(AT) | BIT(ID) | BIT(PER_TICK)},
    [FAULT_KIND_BUS_OFF] = {TIMES, BIT(AT) | BIT(SIDE)},
    [FAULT_KIND_STOP] = {TIMES, BIT(AT) | BIT(NODE)},
    [FAULT_KIND_RESTART] = {0, BIT(AT) | BIT(NODE)},
    [FAULT_KIND_HEARTBEAT_STOP] = {TIMES, BIT(AT) | BIT(NODE)},
    [FAULT_KIND_ENCODER_FREEZE] = {TIMES, BIT(AT) | BIT(NODE)},
    [FAULT_KIND_ENCODER_JUMP] = {TIMES, BIT(AT) | BIT(NODE) | BIT(COUNTS)},
    [FAULT_KIND_ENCODER_FAULT] = {TIMES, BIT(AT) | BIT(NODE)},
    [FAULT_KIND_SATURATE] = {TIMES, BIT(AT) | BIT(NODE) | BIT(VOLTS)},
    [FAULT_KIND_LOAD] = {TIMES, BIT(AT) | BIT(NODE) | BIT(VOLTS)},
    [FAULT_KIND_LIMIT_SWITCH] = {TIMES, BIT(AT) | BIT(NODE) | BIT(SIDE)},
    [FAULT_KIND_FAULT] = {0, BIT(AT) | BIT(NODE) | BIT(CODE)},
};

/* ---- values ---- */

static bool is_hex(const char *digits)
{
    return digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X');
}

/* Decimal, or hexadecimal after 0x; a leading zero means nothing; fractions in FIELD_NUMBER only. False: no such
 * number. Whole numbers up to 2^53 are exact. */
static bool read_value(const char *text, enum field_type type, double *out)
{
    char *end = NULL;
    const bool negative = text[0] == '-';
    const char *digits = negative ? text + 1 : text;
    const bool hex = is_hex(digits);
    if (!(digits[0] >= '0' && digits[0] <= '9') && digits[0] != '.') {
        return false;
    }
    errno = 0;
    if (type == FIELD_NUMBER && !hex) {
        *out = strtod(digits, &end);
    } else {
        *out = (double)strtoull(digits, &end, hex ? 16 : 10);
    }
    *out = negative ? -*out : *out;
    return end != digits && *end == '\0' && errno == 0;
}

/* Puts a number, which must be one of the field's type, into it. Not for FIELD_SIDE. */
static void store_value(unsigned char *field, enum field_type type, double number)
{
    const int64_t whole = type == FIELD_NUMBER ? 0 : (int64_t)number;
    const uint8_t u8 = (uint8_t)whole;
    const uint16_t u16 = (uint16_t)whole;
    const uint32_t u32 = (uint32_t)whole;
    const int32_t i32 = (int32_t)whole;
    switch (type) {
    case FIELD_U8:
        memcpy(field, &u8, sizeof u8);
        break;
    case FIELD_U16:
        memcpy(field, &u16, sizeof u16);
        break;
    case FIELD_U32:
        memcpy(field, &u32, sizeof u32);
        break;
    case FIELD_I32:
        memcpy(field, &i32, sizeof i32);
        break;
    default:
        memcpy(field, &number, sizeof number);
        break;
    }
}

/* ---- keys of a rule ---- */

/* KEYS: there is none of that name. */
static unsigned find_key(const char *name)
{
    unsigned key = 0;
    while (key < KEYS && strcmp(name, keys[key].name) != 0) {
        key++;
    }
    return key;
}

/* Fills in how long a rule lasts, from the keys that were given. False: they exclude each other. */
static bool settle_duration(struct fault_rule *rule, uint32_t seen)
{
    const uint32_t given = seen & (BIT(FOR) | BIT(FOR_MS));
    if (given == (BIT(FOR) | BIT(FOR_MS))) {
        return false;
    }
    if (given == BIT(FOR_MS)) {
        rule->for_ticks = 0;
    } else if (given == 0u) {
        rule->for_ticks = rule->kind == FAULT_KIND_ENCODER_JUMP ? FAULT_FOR_EVER : 1u;
    }
    return true;
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

/* Puts a value into its field; false: not a value of that key, or out of range. */
static bool store_key(struct fault_rule *rule, unsigned key, const char *value)
{
    const struct key *it = &keys[key];
    double number = 0.0;
    if (it->type == FIELD_SIDE) {
        return store_side(rule, value);
    }
    if (!read_value(value, it->type, &number) || number < it->low || number > it->high) {
        return false;
    }
    if (key == KEY_VOLTS && rule->kind == FAULT_KIND_SATURATE && number <= 0.0) {
        return false;
    }
    store_value((unsigned char *)rule + it->offset, it->type, number);
    return true;
}

/* ---- text ---- */

/* The buffer for the text of an error, and the line with the error. */
struct place {
    char *reason;
    size_t size;
    uint32_t line;
};

static int wrong(const struct place *at, const char *what, const char *name)
{
    (void)snprintf(at->reason, at->size, "line %u: %s '%s'", (unsigned)at->line, what, name);
    return FAULT_RULES_WRONG;
}

/* The first of the missing keys. */
static int lacks(const struct place *at, enum fault_kind kind, uint32_t missing)
{
    unsigned key = 0;
    while ((missing >> key & 1u) == 0u) {
        key++;
    }
    (void)snprintf(at->reason, at->size, "line %u: %s needs %s=", (unsigned)at->line,
                   fault_kind_name(kind), keys[key].name);
    return FAULT_RULES_WRONG;
}

static bool find_kind(const char *word, enum fault_kind *kind)
{
    for (unsigned i = 0; i < FAULT_KINDS; i++) {
        if (strcmp(word, fault_kind_name((enum fault_kind)i)) == 0) {
            *kind = (enum fault_kind)i;
            return true;
        }
    }
    return false;
}

/* One key=value; cuts `word` in two. */
static int take_pair(struct fault_rule *rule, uint32_t *seen, char *word, const struct place *at)
{
    char *value = strchr(word, '=');
    if (value == NULL) {
        return wrong(at, "key=value is needed, not", word);
    }
    *value++ = '\0';
    const unsigned key = find_key(word);
    if (key == KEYS) {
        return wrong(at, "there is no key", word);
    }
    const struct needs *needs = &kinds[rule->kind];
    if (((needs->allowed | needs->required) >> key & 1u) == 0u) {
        return wrong(at, "this kind of fault has no key", word);
    }
    if ((*seen >> key & 1u) != 0u) {
        return wrong(at, "given twice:", word);
    }
    *seen |= UINT32_C(1) << key;
    if (!store_key(rule, key, value)) {
        value[-1] = '=';
        return wrong(at, "no value of this key, or out of its range:", word);
    }
    return 0;
}

static int check_rule(struct fault_rule *rule, uint32_t seen, const struct place *at)
{
    const uint32_t missing = kinds[rule->kind].required & ~seen;
    if (missing != 0u) {
        return lacks(at, rule->kind, missing);
    }
    if (!settle_duration(rule, seen)) {
        return wrong(at, "either for= or for_ms=, not both, in", fault_kind_name(rule->kind));
    }
    return 0;
}

/* A line without its end, blanks cut by strtok_r's rules but without its hidden state. */
static char *next_word(char **rest)
{
    static const char blanks[] = " \t\r";
    char *word = *rest + strspn(*rest, blanks);
    if (*word == '\0') {
        return NULL;
    }
    char *end = word + strcspn(word, blanks);
    *rest = *end == '\0' ? end : end + 1;
    *end = '\0';
    return word;
}

static int take_line(struct fault_rules *rules, char *line, const struct place *at)
{
    line[strcspn(line, "#")] = '\0';
    char *word = next_word(&line);
    if (word == NULL) {
        return 0;
    }
    if (rules->count == FAULT_RULES_MAX) {
        return wrong(at, "too many rules, at most 64: no room for", word);
    }
    struct fault_rule *rule = &rules->rules[rules->count];
    *rule = (struct fault_rule){.line = at->line, .p = 1.0, .seed = 1};
    if (!find_kind(word, &rule->kind)) {
        return wrong(at, "there is no kind of fault", word);
    }
    uint32_t seen = 0;
    while ((word = next_word(&line)) != NULL) {
        if (take_pair(rule, &seen, word, at) != 0) {
            return FAULT_RULES_WRONG;
        }
    }
    rules->count++;
    return check_rule(rule, seen, at);
}

int fault_rules_parse(struct fault_rules *rules, const char *text, size_t length, char *reason,
                      size_t size)
{
    struct place at = {reason, size, 0};
    const char *end = text + length;
    rules->count = 0;
    while (text < end) {
        char line[FAULT_LINE_MAX + 1u];
        const char *stop = memchr(text, '\n', (size_t)(end - text));
        const size_t bytes = (size_t)((stop != NULL ? stop : end) - text);
        at.line++;
        if (bytes > FAULT_LINE_MAX || memchr(text, '\0', bytes) != NULL) {
            return wrong(&at, "longer than 200 characters, or no text:", "the line");
        }
        memcpy(line, text, bytes);
        line[bytes] = '\0';
        if (take_line(rules, line, &at) != 0) {
            return FAULT_RULES_WRONG;
        }
        text += bytes + (stop != NULL ? 1u : 0u);
    }
    return 0;
}

static int refuse_file(char *reason, size_t size, const char *path, const char *what)
{
    (void)snprintf(reason, size, "%s: %s", path, what);
    return FAULT_RULES_WRONG;
}

int fault_rules_read(struct fault_rules *rules, const char *path, char *reason, size_t size)
{
    char text[FAULT_FILE_MAX + 1u];
    char what[320];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return refuse_file(reason, size, path, strerror(errno));
    }
    const size_t length = fread(text, 1, sizeof text, file);
    const bool failed = ferror(file) != 0;
    (void)fclose(file);
    if (failed) {
        return refuse_file(reason, size, path, "cannot be read");
    }
    if (length > FAULT_FILE_MAX) {
        return refuse_file(reason, size, path, "longer than 16384 bytes: no file of fault rules");
    }
    if (fault_rules_parse(rules, text, length, what, sizeof what) != 0) {
        return refuse_file(reason, size, path, what);
    }
    return 0;
}
