/* SPDX-License-Identifier: MIT */
#include "app/fault.h"

const char *fault_text(uint16_t code)
{
    switch (code) {
    case FAULT_NOT_ENABLED:
        return "drive did not switch on in time, statusword";
    case FAULT_DROPPED_OUT:
        return "drive left Operation enabled by itself, statusword";
    case FAULT_REBOOTED:
        return "drive restarted by itself, detail";
    default:
        return emcy_text(code);
    }
}
