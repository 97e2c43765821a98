/* SPDX-License-Identifier: MIT */
/* tick: what happens each period, in its order on the bus: SYNC, then the setpoints that belong to
 * it. */
#ifndef APP_TICK_H
#define APP_TICK_H

#include <stdint.h>

#include "app/machine.h"
#include "app/offsets.h"
#include "canopen/sync.h"

/* A SYNC that a simulated drive leaves unanswered is followed by the next one after this time. */
#define TICK_GUARD_US 100000u

struct tick {
    struct machine *machine;
    struct sync_producer sync;
    struct offsets offsets;
};

void tick_init(struct tick *tick, struct machine *machine);

/* One period: send SYNC k; look at what the drives answered to the last one; move the machine on;
 * send setpoints k, then what feedforward adds to them. Timer. */
void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns);

#endif
