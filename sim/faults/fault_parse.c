/* SPDX-License-Identifier: MIT */
#include "faults/fault_parse.h"

#include <stdio.h>
#include <string.h>

#include "faults/fault_keys.h"

/* Where complaints go, and about which line. */
struct place {
    char *reason;
    size_t size;
    uint32_t line;
};

static int wrong(const struct place *at, const char *what, const char *name)
{
    (void)snprintf(at->reason, at->size, "line %u: %s '%s'", (unsigned)at->line, what, name);
    return FAULT_PARSE_WRONG;
}

static int lacks(const struct place *at, enum fault_kind kind, uint32_t missing)
{
    (void)snprintf(at->reason, at->size, "line %u: %s needs %s=", (unsigned)at->line,
                   fault_kind_name(kind), fault_key_name(missing));
    return FAULT_PARSE_WRONG;
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
    const uint32_t key = fault_key_find(word);
    if (key == 0u) {
        return wrong(at, "there is no key", word);
    }
    if ((fault_keys_allowed(rule->kind) & key) == 0u) {
        return wrong(at, "this kind of fault has no key", word);
    }
    if ((*seen & key) != 0u) {
        return wrong(at, "given twice:", word);
    }
    *seen |= key;
    if (!fault_key_store(rule, key, value)) {
        value[-1] = '=';
        return wrong(at, "no value of this key, or out of its range:", word);
    }
    return 0;
}

static int check_rule(struct fault_rule *rule, uint32_t seen, const struct place *at)
{
    const uint32_t missing = fault_keys_required(rule->kind) & ~seen;
    if (missing != 0u) {
        return lacks(at, rule->kind, missing & (~missing + 1u));
    }
    if (fault_keys_settle(rule, seen) != 0) {
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
            return FAULT_PARSE_WRONG;
        }
    }
    rules->count++;
    return check_rule(rule, seen, at);
}

int fault_parse(struct fault_rules *rules, const char *text, size_t length, char *reason,
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
            return FAULT_PARSE_WRONG;
        }
        text += bytes + (stop != NULL ? 1u : 0u);
    }
    return 0;
}
