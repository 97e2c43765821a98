/* SPDX-License-Identifier: MIT */
/* tick_count: which tick it is, from the traffic (docs/reference/protocol.md section 4).
 *
 * Tick 0 is the first SYNC after an enabled setpoint (RPDO1 with controlword bits 0 to 3 set) whose
 * target differs from the enabled one before it, of any drive. From then on ticks go by the SYNC
 * counter: a SYNC that got lost counts, one that came twice does not. Pure. */
#ifndef FAULTS_TICK_COUNT_H
#define FAULTS_TICK_COUNT_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

#define TICK_COUNT_NODES 128u

struct tick_count {
    int32_t target[TICK_COUNT_NODES];
    bool enabled[TICK_COUNT_NODES]; /* the last setpoint was */
    bool moving;                    /* the next SYNC is tick 0, or it was */
    bool begun;
    uint8_t counter; /* of the last SYNC; 0: it had none */
    int64_t tick;    /* -1 before tick 0 */
};

void tick_count_init(struct tick_count *count);

/* A frame of the controller, before anything was done to it. Returns whether a tick begins. */
bool tick_count_receive(struct tick_count *count, const struct can_msg *in);

#endif
