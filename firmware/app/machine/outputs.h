/* SPDX-License-Identifier: MIT */
/*
 * outputs: sends the outputs that a path switches to the I/O module. Called by app/tick after the machine's step.
 * Timer; outputs_init in the main loop. Changes its struct and the outputs of the machine's motion.
 *
 * The state of the machine can switch outputs off: hold, stop, end of the program, fault, as 0x2035 configures it.
 * Outputs that are on are delayed by a configured number of ticks. Setpoint k is sent after SYNC k, latched at SYNC k+1
 * and reached at SYNC k+2; the module latches a frame at the next SYNC. So a delay of one tick switches when the axes
 * are at the place. Switching off is not delayed.
 */
#ifndef APP_MACHINE_OUTPUTS_H
#define APP_MACHINE_OUTPUTS_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/machine.h"
#include "can/can_frame.h"

/* The frame is sent when it changes, and at the latest after this number of ticks. */
#define OUTPUTS_REFRESH_TICKS 64u

struct outputs {
    struct path_outputs_values delayed[CONFIG_OUTPUTS_DELAY_MAX]; /* ring */
    uint32_t newest;                                              /* index of its last entry */
    struct path_outputs_values present; /* those that the module has from the next SYNC on */
    struct path_outputs_values sent;
    enum machine_state state_before; /* of the machine, in the last tick */
    uint32_t refresh_ticks;          /* until the frame is sent again; 0: it is due */
};

/* All outputs off; the frame is due. */
void outputs_init(struct outputs *outputs);

/* Computes the outputs of this tick, after the machine's step. `synced`: a SYNC has been sent in this tick. Where the
 * state clears the outputs, those of machine->motion are cleared too. Timer. */
void outputs_step(struct outputs *outputs, struct machine *machine, bool synced);

/* True when *out is to be sent in this tick. Timer. */
bool outputs_due(const struct outputs *outputs, const struct config_outputs *config,
                 struct can_msg *out);

/* The port has accepted the frame of outputs_due. Timer. */
void outputs_sent(struct outputs *outputs);

#endif
