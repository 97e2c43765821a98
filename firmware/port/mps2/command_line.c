/* SPDX-License-Identifier: MIT */
#include "port/mps2/command_line.h"

#include <string.h>

/* What follows `name` and "=", or NULL when the word is another. */
static const char *value_of(const char *word, const char *name)
{
    const size_t length = strlen(name);
    return strncmp(word, name, length) == 0 && word[length] == '=' ? word + length + 1u : NULL;
}

static bool set_node(struct command_line *line, const char *value)
{
    uint32_t node = 0;
    for (; *value >= '0' && *value <= '9' && node < 128u; ++value) {
        node = 10u * node + (uint32_t)(*value - '0');
    }
    line->node = (uint8_t)node;
    return *value == '\0' && node >= 1u && node <= 127u;
}

static bool choose(bool *chosen, const char *value, const char *yes, const char *no)
{
    *chosen = strcmp(value, yes) == 0;
    return *chosen || strcmp(value, no) == 0;
}

static bool set_path(const char **path, const char *value)
{
    *path = value;
    return *value != '\0';
}

static bool take(struct command_line *line, const char *word)
{
    const char *value = NULL;
    if (strcmp(word, "verbose") == 0) {
        line->verbose = true;
        return true;
    }
    if ((value = value_of(word, "node")) != NULL) {
        return set_node(line, value);
    }
    if ((value = value_of(word, "link")) != NULL) {
        return choose(&line->fifo, value, "fifo", "slcan");
    }
    if ((value = value_of(word, "pace")) != NULL) {
        return choose(&line->fast, value, "fast", "real-time");
    }
    if ((value = value_of(word, "out")) != NULL) {
        return set_path(&line->out, value);
    }
    value = value_of(word, "in");
    return value != NULL && set_path(&line->in, value);
}

bool command_line_parse(struct command_line *line, char *text, const char **wrong)
{
    *line = (struct command_line){.out = "out", .in = "in", .node = 1};
    while (*text != '\0') {
        if (*text == ' ') {
            *text++ = '\0';
            continue;
        }
        char *word = text;
        text += strcspn(text, " ");
        const bool last = *text == '\0';
        *text = '\0';
        if (!take(line, word)) {
            *wrong = word;
            return false;
        }
        text += last ? 0 : 1;
    }
    return true;
}
