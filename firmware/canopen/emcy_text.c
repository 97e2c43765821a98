/* SPDX-License-Identifier: MIT */
#include "canopen/emcy.h"

#include <stddef.h>

struct error_text {
    uint16_t code;
    uint16_t mask; /* bits that must agree: the whole code, or its class */
    const char *text;
};

/* Single codes before the classes that contain them. */
static const struct error_text texts[] = {
    {EMCY_NO_ERROR, 0xFF00, "no error"},
    {EMCY_OVERLOAD, 0xFFFF, "continuous over-current (overload)"},
    {EMCY_DC_UNDERVOLTAGE, 0xFFFF, "DC link under-voltage"},
    {EMCY_POSITION_SENSOR, 0xFFFF, "position sensor"},
    {EMCY_POSITION_SENSOR_1, 0xFFFF, "position sensor"},
    {EMCY_CAN_OVERRUN, 0xFFFF, "CAN overrun: frames lost"},
    {EMCY_CAN_PASSIVE, 0xFFFF, "CAN in error passive mode"},
    {EMCY_HEARTBEAT, 0xFFFF, "heartbeat of another node lost"},
    {EMCY_BUS_OFF_RECOVERED, 0xFFFF, "recovered from bus off"},
    {EMCY_PDO_LENGTH, 0xFFFF, "PDO not processed: too short"},
    {EMCY_SYNC_LENGTH, 0xFFFF, "SYNC of unexpected length"},
    {EMCY_RPDO_TIMEOUT, 0xFFFF, "expected PDO did not come"},
    {EMCY_FOLLOWING_ERROR, 0xFFFF, "following error"},
    {EMCY_POSITION_LIMIT, 0xFFFF, "position limit"},
    {EMCY_SYNC_LOST, 0xFFFF, "SYNC lost"},
    {0x1000, 0xF000, "generic error"},
    {0x2000, 0xF000, "current"},
    {0x3000, 0xF000, "voltage"},
    {0x4000, 0xF000, "temperature"},
    {0x5000, 0xF000, "device hardware"},
    {0x6000, 0xF000, "device software"},
    {0x7000, 0xF000, "additional modules"},
    {0x8100, 0xFF00, "communication"},
    {0x8000, 0xF000, "monitoring"},
    {0x9000, 0xF000, "external error"},
    {0xF000, 0xF000, "manufacturer specific or additional functions"},
};

const char *emcy_text(uint16_t code)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if ((code & texts[i].mask) == texts[i].code) {
            return texts[i].text;
        }
    }
    return "unknown error code";
}
