/* SPDX-License-Identifier: MIT */
/* long_options: reads the command line of a program, one option after the other, by getopt_long. Everything except the
 * known options is an error, reported in one line. An option may be shortened as long as it is unique. Used by
 * port/linux/options and sim/.
 *
 *     struct long_options line = long_options_begin(argc, argv, known, reason, sizeof reason);
 *     for (int option = long_options_next(&line); option > 0; option = long_options_next(&line)) ...
 *
 * One thread, one command line at a time: getopt_long keeps its state in globals. */
#ifndef PORT_LINUX_LONG_OPTIONS_H
#define PORT_LINUX_LONG_OPTIONS_H

#include <getopt.h>
#include <stdbool.h>
#include <stddef.h>

#define LONG_OPTIONS_END   0
#define LONG_OPTIONS_WRONG (-1)

/* Read `value`; `quoted`, `no_value` and `unknown` may be set after long_options_begin; all other fields are private.
 * */
struct long_options {
    int argc;
    char **argv;
    const struct option *known;
    char *value;  /* of the option read last; into argv */
    char *reason; /* after LONG_OPTIONS_WRONG: one line */
    size_t reason_size;
    const char *no_value; /* text before an option whose value is missing */
    const char *unknown;  /* text before an option that is not known */
    bool quoted;          /* the word at fault stands in quotes */
};

/* `known` ends with an all-zero row; its `flag` are NULL, its `val` above 0 and not ':' or '?'. All must stay valid. */
struct long_options long_options_begin(int argc, char **argv, const struct option *known,
                                       char *reason, size_t reason_size);

/* `val` of the next option; LONG_OPTIONS_END after the last one; or LONG_OPTIONS_WRONG with the reason. */
int long_options_next(struct long_options *line);

/* Writes the reason: a text and the word at fault. Returns LONG_OPTIONS_WRONG. */
int long_options_wrong(const struct long_options *line, const char *text, const char *word);

#endif
