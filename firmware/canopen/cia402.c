/* SPDX-License-Identifier: MIT */
/* Implements canopen/cia402.h (see there): states, controlword and statusword of the drive profile. Used by
 * firmware/app, firmware/canopen and sim/node. Pure, any context. */
#include "canopen/cia402.h"

#include <stddef.h>

struct coding {
    const char *name;
    uint16_t bits;
};

static const struct coding codings[CIA402_STATES] = {
    [CIA402_NOT_READY] = {"Not ready to switch on", 0x00},
    [CIA402_SWITCH_ON_DISABLED] = {"Switch on disabled", 0x40},
    [CIA402_READY_TO_SWITCH_ON] = {"Ready to switch on", 0x21},
    [CIA402_SWITCHED_ON] = {"Switched on", 0x23},
    [CIA402_OPERATION_ENABLED] = {"Operation enabled", 0x27},
    [CIA402_QUICK_STOP_ACTIVE] = {"Quick stop active", 0x07},
    [CIA402_FAULT_REACTION_ACTIVE] = {"Fault reaction active", 0x0F},
    [CIA402_FAULT] = {"Fault", 0x08},
};

/* In four states bit 5 has no meaning. Codes that are not listed are CIA402_NOT_READY, which is 0. */
const uint8_t cia402_states[CIA402_CODES] = {
    [CIA402_CODE(0x40)] = CIA402_SWITCH_ON_DISABLED,
    [CIA402_CODE(0x60)] = CIA402_SWITCH_ON_DISABLED,
    [CIA402_CODE(0x21)] = CIA402_READY_TO_SWITCH_ON,
    [CIA402_CODE(0x23)] = CIA402_SWITCHED_ON,
    [CIA402_CODE(0x27)] = CIA402_OPERATION_ENABLED,
    [CIA402_CODE(0x07)] = CIA402_QUICK_STOP_ACTIVE,
    [CIA402_CODE(0x0F)] = CIA402_FAULT_REACTION_ACTIVE,
    [CIA402_CODE(0x2F)] = CIA402_FAULT_REACTION_ACTIVE,
    [CIA402_CODE(0x08)] = CIA402_FAULT,
    [CIA402_CODE(0x28)] = CIA402_FAULT,
};

uint16_t cia402_status_bits(enum cia402_state state)
{
    return codings[state].bits;
}

const char *cia402_state_name(enum cia402_state state)
{
    return (size_t)state < CIA402_STATES ? codings[state].name : "unknown";
}
