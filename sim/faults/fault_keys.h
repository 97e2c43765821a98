/* SPDX-License-Identifier: MIT */
/* fault_keys: the keys of fault rules (docs/reference/protocol.md section 4), each a bit: which kind has
 * which, and their ranges. */
#ifndef FAULTS_FAULT_KEYS_H
#define FAULTS_FAULT_KEYS_H

#include "faults/fault_rule.h"

/* The bit of a key, 0: there is none of that name. */
uint32_t fault_key_find(const char *name);

/* The name of a key by its bit. */
const char *fault_key_name(uint32_t key);

/* Keys that a kind may have, and those it must have. */
uint32_t fault_keys_allowed(enum fault_kind kind);
uint32_t fault_keys_required(enum fault_kind kind);

/* Fills in how long a rule lasts, from the keys that were given. -1: they exclude each other. */
int fault_keys_settle(struct fault_rule *rule, uint32_t seen);

/* Puts a value into its field; false: not a value of that key, or out of range. */
bool fault_key_store(struct fault_rule *rule, uint32_t key, const char *value);

#endif
