/* SPDX-License-Identifier: MIT */
/* Implements port/linux/long_options.h (see there): reads the command line of a program, one option after the other, by
 * getopt_long. Used by port/linux/options and sim/. One thread. Changes its struct and the globals of getopt, and
 * writes the error to the caller's buffer. */
#define _GNU_SOURCE
#include "port/linux/long_options.h"

#include <stdio.h>

struct long_options long_options_begin(int argc, char **argv, const struct option *known,
                                       char *reason, size_t reason_size)
{
    optind = 0; /* from the start, in a second call too */
    return (struct long_options){.argc = argc,
                                 .argv = argv,
                                 .known = known,
                                 .reason = reason,
                                 .reason_size = reason_size,
                                 .no_value = "a value must follow the option",
                                 .unknown = "unknown option"};
}

int long_options_wrong(const struct long_options *line, const char *text, const char *word)
{
    const char *quote = line->quoted ? "'" : "";
    (void)snprintf(line->reason, line->reason_size, "%s %s%s%s (see --help)", text, quote, word,
                   quote);
    return LONG_OPTIONS_WRONG;
}

int long_options_next(struct long_options *line)
{
    const int at = optind > 0 ? optind : 1;
    const int option = getopt_long(line->argc, line->argv, "+:", line->known, NULL);
    line->value = optarg;
    switch (option) {
    case -1:
        return optind < line->argc ? long_options_wrong(line, line->unknown, line->argv[optind])
                                   : LONG_OPTIONS_END;
    case ':':
        return long_options_wrong(line, line->no_value, line->argv[at]);
    case '?':
        return long_options_wrong(line, line->unknown, line->argv[at]);
    default:
        return option;
    }
}
