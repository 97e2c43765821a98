/* SPDX-License-Identifier: MIT */
/* Implements trouble.h (see there): what the drives of isr.c do wrong, by a word of the command line. Part of the image
 * isr; no I/O. */
#include "trouble.h"

#include <string.h>

/* K of NAME:K. */
static uint32_t tick_of(const char *word, const char *name)
{
    const size_t length = strlen(name);
    uint32_t tick = 0;
    if (strncmp(word, name, length) != 0) {
        return UINT32_MAX;
    }
    for (const char *at = word + length; *at >= '0' && *at <= '9'; at++) {
        tick = tick * 10u + (uint32_t)(*at - '0');
    }
    return tick;
}

bool trouble_read(struct trouble *trouble, const char *word)
{
    trouble->silent = strcmp(word, "silent") == 0;
    trouble->lost_from = tick_of(word, "lost:");
    trouble->error_from = tick_of(word, "error:");
    return trouble->silent || trouble_is_fatal(trouble);
}

bool trouble_is_fatal(const struct trouble *trouble)
{
    return trouble->lost_from != UINT32_MAX || trouble->error_from != UINT32_MAX;
}
