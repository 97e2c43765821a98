/* SPDX-License-Identifier: MIT */
/*
 * outputs: the outputs of the path on their way to the I/O module: what the machine's state leaves of them, the ticks by which
 * they are held back, and the frame.
 *
 * Setpoint k is sent after SYNC k, latched at SYNC k+1 and reached at SYNC k+2. The module latches a frame at the next SYNC.
 * So outputs that are held back by one tick are at a place when the axes are there. What switches outputs off (a stop, a
 * fault) is not held back.
 */
#ifndef APP_MACHINE_OUTPUTS_H
#define APP_MACHINE_OUTPUTS_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/machine.h"
#include "can/can_frame.h"

/* The frame is sent when it changes, and again after so many ticks. */
#define OUTPUTS_REFRESH_TICKS 64u

struct outputs {
    struct path_outputs_values held_back[CONFIG_OUTPUTS_DELAY_MAX]; /* a ring, */
    uint32_t newest;                                                /* whose last entry this is */
    struct path_outputs_values present; /* to be at the module from the next SYNC on */
    struct path_outputs_values sent;
    uint32_t refresh_ticks; /* until the frame is sent again; 0: it is due */
};

/* All outputs off; the frame is due. */
void outputs_init(struct outputs *outputs);

/* The outputs of this tick, after the machine's step. `synced`: a SYNC has been sent in it. Where outputs go off by the state of
 * the machine, those of its motion do, too. Timer. */
void outputs_step(struct outputs *outputs, struct machine *machine, bool synced);

/* True when *out is to be sent in this tick. Timer. */
bool outputs_due(const struct outputs *outputs, const struct config_outputs *config,
                 struct can_msg *out);

/* It has been sent. Timer. */
void outputs_sent(struct outputs *outputs);

#endif
