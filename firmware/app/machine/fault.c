/* SPDX-License-Identifier: MIT */
/* Implements app/machine/fault.h (see there): what stopped the machine (object 0x2003 subs 1 to 3). Used by
 * firmware/app. Plain data of machine, guarded by the port's lock; the functions are pure. */
#include "app/machine/fault.h"

const char *fault_text(uint16_t code)
{
    switch (code) {
    case FAULT_NOT_ENABLED:
        return "drive did not switch on in time, statusword";
    case FAULT_DROPPED_OUT:
        return "drive left Operation enabled by itself, statusword";
    case FAULT_REBOOTED:
        return "drive restarted by itself, detail";
    case FAULT_HOMING_MODE:
        return "drive does not change its mode of operation for homing, abort code or mode";
    case FAULT_HOMING_FAILED:
        return "drive reports a homing error, statusword";
    case FAULT_HOMING_LATE:
        return "drive did not find its home in time, statusword";
    case FAULT_NOT_REMOTE:
        return "drive does not follow its controlword (remote off), statusword";
    case FAULT_NOT_FOLLOWING:
        return "drive is enabled but does not follow its target, statusword";
    case FAULT_NOT_STOPPED:
        return "drive did not end its quick stop in time, statusword";
    case FAULT_NOT_SENT:
        return "the bus takes no frames of the controller, ticks in a row";
    case FAULT_POSITION_DEVIATION:
        return "axis is not where its setpoints are, counts";
    case FAULT_SYNC_GAP:
        return "no SYNC for too long with real drives, microseconds";
    case FAULT_STOP_LATE:
        return "stop along the path took longer than its bound and a fifth, setpoint";
    case FAULT_MAIN_LOOP_STALL:
        return "the main loop of the controller stood still, microseconds";
    default:
        return emcy_text(code);
    }
}

bool fault_is_vague(uint16_t code)
{
    return code == EMCY_GENERIC || code == FAULT_DROPPED_OUT || code == FAULT_NOT_FOLLOWING;
}

bool fault_is_drives(uint16_t code)
{
    return code != EMCY_NO_ERROR && code < EMCY_MANUFACTURER;
}

uint32_t fault_drive_detail(uint16_t code, uint16_t statusword)
{
    return code == EMCY_RPDO_TIMEOUT ? 0u : statusword;
}
