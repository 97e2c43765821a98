/* SPDX-License-Identifier: MIT */
/* tick: what happens each period, in its order on the bus: SYNC, then the setpoints that belong to
 * it. */
#ifndef APP_TICK_H
#define APP_TICK_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/machine.h"
#include "app/machine/offsets.h"
#include "app/machine/outputs.h"
#include "canopen/sync.h"

struct tick {
    struct machine *machine;
    struct sync_producer sync;
    struct offsets offsets;
    struct outputs outputs;
    bool refused;          /* the port took not all frames of this tick */
    bool setpoint_refused; /* and a setpoint was among them */
};

void tick_init(struct tick *tick, struct machine *machine);

/* One period: send SYNC k; look at what the drives answered to the last one; move the machine on;
 * send setpoints k, then what feedforward adds to them, then outputs that change; for simulated drives ask the port to wait for their answers, for
 * answer_wait_ms (0x2004 sub 8) or a period at most. Timer. */
void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns);

#endif
