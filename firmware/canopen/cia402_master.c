/* SPDX-License-Identifier: MIT */
/* Implements canopen/cia402_master.h (see there): the controlword that brings a drive nearer to a goal. Called by
 * app/drives/homing, and by app/machine/axis in each tick, with the latest state; the result is the controlword to
 * send. Pure functions, any context. */
#include "canopen/cia402_master.h"

/* Towards the goal one state after the other; at or above the goal the command that keeps it. Entries that are not
 * listed are "disable voltage", which is 0 and leaves every other state. */
const uint8_t cia402_master_commands[CIA402_GOALS][CIA402_STATES] = {
    [CIA402_GOAL_READY] = {[CIA402_SWITCH_ON_DISABLED] = CIA402_SHUTDOWN,
                           [CIA402_READY_TO_SWITCH_ON] = CIA402_SHUTDOWN,
                           [CIA402_SWITCHED_ON] = CIA402_SHUTDOWN,
                           [CIA402_OPERATION_ENABLED] = CIA402_SHUTDOWN},
    [CIA402_GOAL_SWITCHED_ON] = {[CIA402_SWITCH_ON_DISABLED] = CIA402_SHUTDOWN,
                                 [CIA402_READY_TO_SWITCH_ON] = CIA402_SWITCH_ON,
                                 [CIA402_SWITCHED_ON] = CIA402_SWITCH_ON,
                                 [CIA402_OPERATION_ENABLED] = CIA402_SWITCH_ON},
    [CIA402_GOAL_ENABLED] = {[CIA402_SWITCH_ON_DISABLED] = CIA402_SHUTDOWN,
                             [CIA402_READY_TO_SWITCH_ON] = CIA402_SWITCH_ON,
                             [CIA402_SWITCHED_ON] = CIA402_ENABLE_OPERATION,
                             [CIA402_OPERATION_ENABLED] = CIA402_ENABLE_OPERATION},
    [CIA402_GOAL_QUICK_STOP] = {CIA402_QUICK_STOP, CIA402_QUICK_STOP, CIA402_QUICK_STOP,
                                CIA402_QUICK_STOP, CIA402_QUICK_STOP, CIA402_QUICK_STOP,
                                CIA402_QUICK_STOP, CIA402_QUICK_STOP},
    [CIA402_GOAL_RESET] = {[CIA402_FAULT] = CIA402_FAULT_RESET},
};

bool cia402_master_reached(enum cia402_goal goal, uint16_t statusword)
{
    static const enum cia402_state wanted[] = {
        [CIA402_GOAL_OFF] = CIA402_SWITCH_ON_DISABLED,
        [CIA402_GOAL_READY] = CIA402_READY_TO_SWITCH_ON,
        [CIA402_GOAL_SWITCHED_ON] = CIA402_SWITCHED_ON,
        [CIA402_GOAL_ENABLED] = CIA402_OPERATION_ENABLED,
        [CIA402_GOAL_QUICK_STOP] = CIA402_QUICK_STOP_ACTIVE,
        [CIA402_GOAL_RESET] = CIA402_SWITCH_ON_DISABLED,
    };

    return cia402_decode(statusword) == wanted[goal];
}
