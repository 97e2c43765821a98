/* SPDX-License-Identifier: MIT */
/* fault_file: fault rules from a file. */
#ifndef FAULTS_FAULT_FILE_H
#define FAULTS_FAULT_FILE_H

#include <stddef.h>

#include "faults/fault_rule.h"

#define FAULT_FILE_MAX 16384u /* bytes */

/* Returns 0, or -1 with one line in `reason`: which file, which line, what is wrong. */
int fault_file_read(struct fault_rules *rules, const char *path, char *reason, size_t size);

#endif
