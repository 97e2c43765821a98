/* SPDX-License-Identifier: MIT */
/* cia402_master: the controller's side of the CiA 402 state machine: which controlword brings a drive nearer to a goal.
 *
 * Called by app/drives/homing, and by app/machine/axis in each tick, with the latest state; the result is the
 * controlword to send. The caller keeps the previous controlword, for the rising edge of the fault reset. Pure
 * functions, any context. */
#ifndef CANOPEN_CIA402_MASTER_H
#define CANOPEN_CIA402_MASTER_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402.h"

enum cia402_goal {
    CIA402_GOAL_OFF, /* Switch on disabled; also out of Quick stop active. It does not change a Fault */
    CIA402_GOAL_READY, /* Ready to switch on */
    CIA402_GOAL_SWITCHED_ON,
    CIA402_GOAL_ENABLED, /* Operation enabled. From Quick stop active through Switch on disabled */
    CIA402_GOAL_QUICK_STOP, /* Quick stop active from Operation enabled; else off. The command does
                               not depend on the statusword, which may be wrong or old */
    CIA402_GOAL_RESET       /* out of Fault, to Switch on disabled */
};
#define CIA402_GOALS 6

/* Commands by goal and state. */
extern const uint8_t cia402_master_commands[CIA402_GOALS][CIA402_STATES];

/* The controlword to send to a drive in `state` after `previous` was sent: a fault reset is an edge, so it falls
 * again. */
static inline uint16_t cia402_master_controlword(enum cia402_goal goal, enum cia402_state state,
                                                 uint16_t previous)
{
    const uint16_t command = cia402_master_commands[goal][state];
    return (command & previous & CIA402_CONTROL_FAULT_RESET) != 0u ? CIA402_DISABLE_VOLTAGE
                                                                   : command;
}

/* Whether the drive has reached the goal. */
bool cia402_master_reached(enum cia402_goal goal, uint16_t statusword);

#endif
