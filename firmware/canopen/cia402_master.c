/* SPDX-License-Identifier: MIT */
#include "canopen/cia402_master.h"

/* Upwards one state after the other: the command that leads from `state` towards `target`. Where
 * `state` is at or above it, the command that leads to (or keeps) the target is the same one. */
static uint16_t climb(enum cia402_state state, enum cia402_state target)
{
    static const uint16_t keeps[] = {
        [CIA402_READY_TO_SWITCH_ON] = CIA402_SHUTDOWN,
        [CIA402_SWITCHED_ON] = CIA402_SWITCH_ON,
        [CIA402_OPERATION_ENABLED] = CIA402_ENABLE_OPERATION,
    };
    enum cia402_state next = state < target ? (enum cia402_state)(state + 1) : target;

    if (state < CIA402_SWITCH_ON_DISABLED || state > CIA402_OPERATION_ENABLED) {
        return CIA402_DISABLE_VOLTAGE;
    }
    return keeps[next];
}

uint16_t cia402_master_controlword(enum cia402_goal goal, uint16_t statusword, uint16_t previous)
{
    enum cia402_state state = cia402_decode(statusword);

    switch (goal) {
    case CIA402_GOAL_READY:
        return climb(state, CIA402_READY_TO_SWITCH_ON);
    case CIA402_GOAL_SWITCHED_ON:
        return climb(state, CIA402_SWITCHED_ON);
    case CIA402_GOAL_ENABLED:
        return climb(state, CIA402_OPERATION_ENABLED);
    case CIA402_GOAL_QUICK_STOP:
        return CIA402_QUICK_STOP;
    case CIA402_GOAL_RESET:
        return state == CIA402_FAULT && (previous & CIA402_CONTROL_FAULT_RESET) == 0
                   ? CIA402_FAULT_RESET
                   : CIA402_DISABLE_VOLTAGE;
    default:
        return CIA402_DISABLE_VOLTAGE;
    }
}

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
