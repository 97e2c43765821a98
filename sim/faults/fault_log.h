/* SPDX-License-Identifier: MIT */
/* fault_log: writes injected faults to a stream, one JSON object for each line. Used by sim/injector/main and
 * sim/node/drives. Any thread; writes to `out` only.
 *
 * Keys: t_ns (CLOCK_MONOTONIC), tick, line (of the rule), kind; of a frame also from ("controller" or "drives"), id and
 * data (hexadecimal, as it came); of a state also on (true, false) and, of a drive's, node. */
#ifndef FAULTS_FAULT_LOG_H
#define FAULTS_FAULT_LOG_H

#include <stdio.h>

#include "can/can_frame.h"
#include "faults/fault_rules.h"

struct fault_event {
    const struct fault_rule *rule;
    uint64_t t_ns;
    int64_t tick;
};

void fault_log_frame(FILE *out, const struct fault_event *event, enum fault_side from,
                     const struct can_msg *frame);
void fault_log_state(FILE *out, const struct fault_event *event, bool on);

#endif
