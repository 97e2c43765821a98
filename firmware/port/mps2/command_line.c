/* SPDX-License-Identifier: MIT */
/* Implements port/mps2/command_line.h (see there): the words that the emulator passes on as options of the board. Used
 * by link and by port_mps2.c at the start. Pure. */
#include "port/mps2/command_line.h"

#include <string.h>

static bool is(const char *word, const char *name, size_t length)
{
    return strlen(name) == length && strncmp(word, name, length) == 0;
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

static bool take_value(struct command_line *line, const char *word, size_t length)
{
    const char *value = word + length + 1u;
    if (is(word, "node", length)) {
        return set_node(line, value);
    }
    if (is(word, "link", length)) {
        return choose(&line->fifo, value, "fifo", "slcan");
    }
    if (is(word, "pace", length)) {
        return choose(&line->fast, value, "fast", "real-time");
    }
    if (is(word, "out", length)) {
        return set_path(&line->out, value);
    }
    return is(word, "in", length) && set_path(&line->in, value);
}

static bool take(struct command_line *line, const char *word)
{
    const char *equals = strchr(word, '=');
    if (equals != NULL) {
        return take_value(line, word, (size_t)(equals - word));
    }
    line->verbose = line->verbose || strcmp(word, "verbose") == 0;
    return strcmp(word, "verbose") == 0;
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
