/* SPDX-License-Identifier: MIT */
#include "canopen/cia402.h"

#include <stddef.h>

/* Bits 0 ... 3 and 6, and those plus bit 5 (quick stop), are what tells the states apart. */
#define MASK_WITHOUT_QUICK_STOP 0x4Fu
#define MASK_WITH_QUICK_STOP    0x6Fu

struct coding {
    const char *name;
    uint16_t bits;
    uint16_t mask;
};

static const struct coding codings[] = {
    [CIA402_NOT_READY] = {"Not ready to switch on", 0x00, MASK_WITHOUT_QUICK_STOP},
    [CIA402_SWITCH_ON_DISABLED] = {"Switch on disabled", 0x40, MASK_WITHOUT_QUICK_STOP},
    [CIA402_READY_TO_SWITCH_ON] = {"Ready to switch on", 0x21, MASK_WITH_QUICK_STOP},
    [CIA402_SWITCHED_ON] = {"Switched on", 0x23, MASK_WITH_QUICK_STOP},
    [CIA402_OPERATION_ENABLED] = {"Operation enabled", 0x27, MASK_WITH_QUICK_STOP},
    [CIA402_QUICK_STOP_ACTIVE] = {"Quick stop active", 0x07, MASK_WITH_QUICK_STOP},
    [CIA402_FAULT_REACTION_ACTIVE] = {"Fault reaction active", 0x0F, MASK_WITHOUT_QUICK_STOP},
    [CIA402_FAULT] = {"Fault", 0x08, MASK_WITHOUT_QUICK_STOP},
};

#define STATES (sizeof codings / sizeof codings[0])

uint16_t cia402_status_bits(enum cia402_state state)
{
    return codings[state].bits;
}

enum cia402_state cia402_decode(uint16_t statusword)
{
    for (size_t i = 0; i < STATES; i++) {
        if ((statusword & codings[i].mask) == codings[i].bits) {
            return (enum cia402_state)i;
        }
    }
    return CIA402_NOT_READY;
}

const char *cia402_state_name(enum cia402_state state)
{
    return (size_t)state < STATES ? codings[state].name : "unknown";
}
