/* SPDX-License-Identifier: MIT */
/* cia402_master: the controller's side of the CiA 402 state machine: which controlword brings a
 * drive nearer to a goal.
 *
 * Called each tick with the latest statusword; the answer is the controlword to send. No memory but
 * the controlword sent before (for the rising edge of the fault reset). Pure functions, any
 * context.
 */
#ifndef CANOPEN_CIA402_MASTER_H
#define CANOPEN_CIA402_MASTER_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402.h"

enum cia402_goal {
    CIA402_GOAL_OFF, /* Switch on disabled; also out of Quick stop active. A Fault is left alone */
    CIA402_GOAL_READY, /* Ready to switch on */
    CIA402_GOAL_SWITCHED_ON,
    CIA402_GOAL_ENABLED, /* Operation enabled. From Quick stop active by way of Switch on disabled
                          */
    CIA402_GOAL_QUICK_STOP, /* Quick stop active from Operation enabled; else off. The command is the same whatever
                               the statusword says: nobody brakes by what may be wrong or old */
    CIA402_GOAL_RESET /* out of Fault, to Switch on disabled */
};

/* The controlword to send after `statusword` came and `previous` was sent last. */
uint16_t cia402_master_controlword(enum cia402_goal goal, uint16_t statusword, uint16_t previous);

/* Whether the drive has arrived. */
bool cia402_master_reached(enum cia402_goal goal, uint16_t statusword);

#endif
