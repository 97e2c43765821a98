/* SPDX-License-Identifier: MIT */
#include "faults/fault_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "faults/fault_parse.h"

static int complain(char *reason, size_t size, const char *path, const char *what)
{
    (void)snprintf(reason, size, "%s: %s", path, what);
    return -1;
}

int fault_file_read(struct fault_rules *rules, const char *path, char *reason, size_t size)
{
    char text[FAULT_FILE_MAX + 1u];
    char what[320];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return complain(reason, size, path, strerror(errno));
    }
    const size_t length = fread(text, 1, sizeof text, file);
    const int failed = ferror(file);
    (void)fclose(file);
    if (failed != 0) {
        return complain(reason, size, path, "cannot be read");
    }
    if (length > FAULT_FILE_MAX) {
        return complain(reason, size, path, "longer than 16384 bytes: no file of fault rules");
    }
    if (fault_parse(rules, text, length, what, sizeof what) != 0) {
        return complain(reason, size, path, what);
    }
    return 0;
}
