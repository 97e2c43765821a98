/* SPDX-License-Identifier: MIT */
/* fault_watch: when a rule acts, by ticks, wall time, number of frames and probability. Pure. */
#ifndef FAULTS_FAULT_WATCH_H
#define FAULTS_FAULT_WATCH_H

#include "can/can_frame.h"
#include "faults/fault_rule.h"

struct fault_watch {
    const struct fault_rule *rule; /* borrowed */
    uint32_t used;                 /* frames so far */
    uint64_t random;               /* state of the generator */
    uint64_t began_ns;             /* when the first tick came; 0: it has not */
};

void fault_watch_init(struct fault_watch *watch, const struct fault_rule *rule);

/* Whether the rule acts at this tick (-1: no motion yet) and instant. `now_ns` is above 0. Call it
 * for every tick, so that wall time counts from the first. */
bool fault_watch_acts(struct fault_watch *watch, int64_t tick, uint64_t now_ns);

/* When a rule that acts for some ms ends; UINT64_MAX: it goes by ticks, or has not begun. */
uint64_t fault_watch_end_ns(const struct fault_watch *watch);

/* Whether this frame is one of the rule's, which acts; counts it. Draws one random number for each
 * frame of the rule's identifier, so that the same traffic has the same faults. */
bool fault_watch_takes(struct fault_watch *watch, const struct can_msg *frame);

#endif
