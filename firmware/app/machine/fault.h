/* SPDX-License-Identifier: MIT */
/* fault: codes of the faults that the controller raises, and the present one (0x2003 subs 1 to 3). Used by
 * firmware/app. Plain data of machine, guarded by the port's lock; the functions are pure. */
#ifndef APP_MACHINE_FAULT_H
#define APP_MACHINE_FAULT_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/emcy.h"

/* Codes of this controller in addition to those of canopen/emcy.h. Detail: the statusword, if not stated otherwise. */
#define FAULT_NOT_ENABLED   (EMCY_MANUFACTURER | 0x01u) /* did not switch on in time */
#define FAULT_DROPPED_OUT   (EMCY_MANUFACTURER | 0x02u) /* left Operation enabled */
#define FAULT_REBOOTED      (EMCY_MANUFACTURER | 0x03u) /* a drive restarted by itself; 0 */
#define FAULT_NOT_REMOTE    (EMCY_MANUFACTURER | 0x04u) /* bit 9 lost: controlword not followed */
#define FAULT_NOT_FOLLOWING (EMCY_MANUFACTURER | 0x05u) /* bit 12 lost: target not followed */
#define FAULT_NOT_STOPPED   (EMCY_MANUFACTURER | 0x06u) /* no end of the quick stop in time */
#define FAULT_NOT_SENT (EMCY_MANUFACTURER | 0x07u) /* own frames do not leave; ticks in a row */
/* position and setpoint apart; counts */
#define FAULT_POSITION_DEVIATION (EMCY_MANUFACTURER | 0x08u)
#define FAULT_SYNC_GAP (EMCY_MANUFACTURER | 0x09u) /* no SYNC for too long, real drives; us */
/* a stop along the path beyond its deadline; setpoint */
#define FAULT_STOP_LATE       (EMCY_MANUFACTURER | 0x0Au)
#define FAULT_MAIN_LOOP_STALL (EMCY_MANUFACTURER | 0x0Bu) /* the main loop has stalled; us */

/* Homing. */
#define FAULT_HOMING_MODE   (EMCY_MANUFACTURER | 0x10u) /* 0x6060 refused; abort code, or 0x6061 */
#define FAULT_HOMING_FAILED (EMCY_MANUFACTURER | 0x11u) /* the drive reports it; statusword */
#define FAULT_HOMING_LATE   (EMCY_MANUFACTURER | 0x12u) /* no end in time; statusword */

struct fault {
    uint16_t code;   /* CANopen emergency error code; 0: none */
    uint8_t node;    /* the node it is about; 0: the controller */
    uint32_t detail; /* depends on the code */
};

/* One English phrase for a fault code, never NULL. Pure. */
const char *fault_text(uint16_t code);

/* Whether this code only describes a state of the statusword, so that the drive's own emergency code is more exact.
 * Pure. */
bool fault_is_vague(uint16_t code);

/* Whether a drive's own emergency code may stand for a fault: not those of the manufacturer (0xFFxx), since the same
 * numbers are faults of this controller. They stay readable in 0x200C and 0x1003. Pure. */
bool fault_is_drives(uint16_t code);

/* The detail of a fault of this code that a drive reports: its statusword. 0 for EMCY_RPDO_TIMEOUT, since the detail of
 * that code counts TPDO1s that the controller has missed. Pure. */
uint32_t fault_drive_detail(uint16_t code, uint16_t statusword);

#endif
