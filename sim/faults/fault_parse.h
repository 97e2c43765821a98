/* SPDX-License-Identifier: MIT */
/* fault_parse: text of fault rules (docs/reference/protocol.md section 4) into structs. Pure, but for the
 * text of an error. */
#ifndef FAULTS_FAULT_PARSE_H
#define FAULTS_FAULT_PARSE_H

#include <stddef.h>

#include "faults/fault_rule.h"

#define FAULT_LINE_MAX 200u /* characters of a line */

#define FAULT_PARSE_WRONG (-1)

/* `length` bytes of text. Returns 0, or FAULT_PARSE_WRONG with one line in `reason`: which line,
 * what is wrong and what would be right. */
int fault_parse(struct fault_rules *rules, const char *text, size_t length, char *reason,
                size_t size);

#endif
