/* SPDX-License-Identifier: MIT */
/* fault_trigger: when a fault rule acts: by ticks, wall time, number of frames and probability; and which tick it is,
 * from the traffic (docs/reference/protocol.md section 4). Used by sim/injector/forwarder and sim/node/node_faults.
 *
 * Tick 0 is the first SYNC after an enabled setpoint (RPDO1 with controlword bits 0 to 3 set) whose
 * target differs from the enabled one before it, of any drive. From then on ticks go by the SYNC
 * counter: a lost SYNC counts, a repeated one does not. The functions change their struct only; one thread.
 */
#ifndef FAULTS_FAULT_TRIGGER_H
#define FAULTS_FAULT_TRIGGER_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "faults/fault_rules.h"

#define FAULT_TICKS_NODES 128u

/* Which tick it is. */
struct fault_ticks {
    int32_t target[FAULT_TICKS_NODES];
    bool enabled[FAULT_TICKS_NODES]; /* the last setpoint was */
    bool moving; /* a motion has begun: the next SYNC is tick 0, or tick 0 is over */
    bool begun;
    uint8_t counter; /* of the last SYNC; 0: it had none */
    int64_t tick;    /* -1 before tick 0 */
};

void fault_ticks_init(struct fault_ticks *ticks);

/* A frame of the controller, before faults are applied to it. Returns whether a tick begins. */
bool fault_ticks_receive(struct fault_ticks *ticks, const struct can_msg *in);

/* When one rule acts. */
struct fault_trigger {
    const struct fault_rule *rule; /* borrowed */
    uint32_t used;                 /* number of frames up to now */
    uint64_t random;               /* state of the generator */
    uint64_t began_ns;             /* time of its first tick; 0: not yet */
};

void fault_trigger_init(struct fault_trigger *trigger, const struct fault_rule *rule);

/* Whether the rule acts at this tick (-1: no motion yet) and instant. `now_ns` is above 0. Call it
 * for every tick, so that wall time counts from the first. */
bool fault_trigger_acts(struct fault_trigger *trigger, int64_t tick, uint64_t now_ns);

/* When a rule that acts for some ms ends; UINT64_MAX: it goes by ticks, or has not begun. */
uint64_t fault_trigger_end_ns(const struct fault_trigger *trigger);

/* Whether this frame is one of the rule's, which acts; counts it. Draws one random number for each
 * frame of the rule's identifier, so that the same traffic has the same faults. */
bool fault_trigger_takes(struct fault_trigger *trigger, const struct can_msg *frame);

#endif
