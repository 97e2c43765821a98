/* SPDX-License-Identifier: MIT */
/* fault: what stopped the machine (object 0x2003 subs 1 to 3). */
#ifndef APP_FAULT_H
#define APP_FAULT_H

#include <stdint.h>

#include "canopen/emcy.h"

/* Codes that only this controller uses, beside those of canopen/emcy.h. */
#define FAULT_NOT_ENABLED                                                                          \
    (EMCY_MANUFACTURER | 0x01u) /* did not switch on in time; detail: statusword */
#define FAULT_DROPPED_OUT                                                                          \
    (EMCY_MANUFACTURER | 0x02u)                    /* left Operation enabled; detail: statusword */
#define FAULT_REBOOTED (EMCY_MANUFACTURER | 0x03u) /* a drive restarted by itself */

/* Homing. */
#define FAULT_HOMING_MODE   (EMCY_MANUFACTURER | 0x10u) /* 0x6060 refused; abort code, or 0x6061 */
#define FAULT_HOMING_FAILED (EMCY_MANUFACTURER | 0x11u) /* the drive says so; statusword */
#define FAULT_HOMING_LATE   (EMCY_MANUFACTURER | 0x12u) /* no end in time; statusword */

struct fault {
    uint16_t code;   /* CANopen emergency error code; 0: none */
    uint8_t node;    /* the node it is about; 0: the controller */
    uint32_t detail; /* depends on the code */
};

/* One English phrase for a fault code, never NULL. Pure. */
const char *fault_text(uint16_t code);

#endif
