/* SPDX-License-Identifier: MIT */
/*
 * tick: all that the controller does in one period: SYNC, supervision of the drives, one step of the machine,
 * setpoints.
 *
 * tick.c contains the order on the bus and all frames of a tick; states and faults are in app/machine. No other module
 * sends SYNC or setpoints. Called by app/controller.c. Timer, once a period, under the port's lock; tick_init in the
 * main loop. Sends frames, and changes the tick and the machine.
 */
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
    bool refused;          /* the port refused a frame of this tick */
    bool setpoint_refused; /* the port refused a setpoint of this tick */
};

void tick_init(struct tick *tick, struct machine *machine);

/* One period k. Sends SYNC k, checks the answers of the drives to SYNC k-1, executes one step of the machine, then
 * sends setpoints k, feedforward and changed outputs. For simulated drives it requests that the port waits for their
 * answers, for at most the longer of answer_wait_ms (0x2004 sub 8) and a period. now_us: port_time_us(); late_ns: delay
 * of this tick after its due time. Timer. */
void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns);

#endif
