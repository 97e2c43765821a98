/* SPDX-License-Identifier: MIT */
/* sync_clock: the time base of a simulated drive: SYNC, or the wall clock while SYNC is missing. It returns how many
 * periods pass; the caller computes them. Called by node/drive_node and node/drive_od. All in one context. Changes only
 * its struct; no I/O.
 */
#ifndef NODE_SYNC_CLOCK_H
#define NODE_SYNC_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/sync.h"

struct sync_clock {
    struct sync_consumer sync;
    uint32_t without_us; /* since the last SYNC */
    uint32_t own_us;     /* wall time not yet turned into periods */
    bool seen;           /* SYNC, since the last sync_clock_process */
    bool lost;           /* the wall clock is the time base */
};

/* The SYNC that follows is the first one. `overflow` is 0x1019. */
void sync_clock_reset_counter(struct sync_clock *clock, uint8_t overflow);

/* SYNC is the time base, and its timeout restarts. */
void sync_clock_await(struct sync_clock *clock);

/* A SYNC frame. Returns the periods since the last one, 0 if it is repeated, or a negative SYNC_... code. After a loss
 * its counter is the new beginning. */
int sync_clock_receive(struct sync_clock *clock, const struct can_msg *in, uint8_t overflow);

/* Wall time passes while SYNC is the time base. Returns true when SYNC is lost now: it did not come for more than
 * `timeout_us`, or is not to be expected (`stopped`). */
bool sync_clock_process(struct sync_clock *clock, uint32_t elapsed_us, uint32_t timeout_us,
                        bool stopped);

/* Wall time passes as the time base. Returns the whole periods in it; the remainder is kept. */
uint32_t sync_clock_own_periods(struct sync_clock *clock, uint32_t elapsed_us, uint32_t period_us);

#endif
