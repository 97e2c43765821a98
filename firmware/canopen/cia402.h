/* SPDX-License-Identifier: MIT */
/* cia402: states, controlword and statusword of the drive profile (CiA 402-2, finite state automaton). Used by
 * firmware/app, firmware/canopen and sim/node.
 *
 * Names and codes that drive and controller share. The state machine of a drive is in cia402_device.h, the controlwords
 * that the controller sends are in cia402_master.h. Pure functions, any context.
 */
#ifndef CANOPEN_CIA402_H
#define CANOPEN_CIA402_H

#include <stdint.h>

/* States by the names of the standard; the numbers are our own. */
enum cia402_state {
    CIA402_NOT_READY,             /* the drive initialises itself */
    CIA402_SWITCH_ON_DISABLED,    /* power stage off; waits for shutdown */
    CIA402_READY_TO_SWITCH_ON,    /* power stage off; waits for switch on */
    CIA402_SWITCHED_ON,           /* power stage on; setpoints have no effect */
    CIA402_OPERATION_ENABLED,     /* the axis follows its setpoints */
    CIA402_QUICK_STOP_ACTIVE,     /* stops, or has stopped, as 0x605A requests */
    CIA402_FAULT_REACTION_ACTIVE, /* stops as 0x605E requests; then Fault */
    CIA402_FAULT                  /* power stage off; waits for a fault reset */
};
#define CIA402_STATES 8

/* Modes of operation, 0x6060 and 0x6061. */
enum cia402_mode {
    CIA402_MODE_NONE = 0,
    CIA402_MODE_HOMING = 6, /* the drive moves the axis by itself and sets its zero */
    CIA402_MODE_CSP = 8,    /* cyclic synchronous position: a target position for each SYNC */
};

/* Bit of 0x6502 (supported drive modes) for a mode 1 ... 32. */
#define CIA402_SUPPORTS(mode) (UINT32_C(1) << ((mode) - 1))

/* Statusword bits that do not belong to the state. */
#define CIA402_STATUS_VOLTAGE         0x0010u /* power stage is fed */
#define CIA402_STATUS_WARNING         0x0080u /* the drive has a warning, and goes on */
#define CIA402_STATUS_REMOTE          0x0200u /* controlword is followed */
#define CIA402_STATUS_TARGET_REACHED  0x0400u /* Quick stop active: at standstill */
#define CIA402_STATUS_LIMIT           0x0800u /* internal limit active */
#define CIA402_STATUS_FOLLOWS         0x1000u /* CSP: drive follows the command value */
#define CIA402_STATUS_FOLLOWING_ERROR 0x2000u /* CSP: out of the window 0x6065 */

/* The same bits in homing mode. */
#define CIA402_STATUS_HOMING_ATTAINED 0x1000u /* the axis has its zero */
#define CIA402_STATUS_HOMING_ERROR    0x2000u /* homing has ended without a zero */

/* Controlword bits. */
#define CIA402_CONTROL_SWITCH_ON    0x0001u /* power stage on */
#define CIA402_CONTROL_VOLTAGE      0x0002u /* enable voltage; 0: power stage off at once */
#define CIA402_CONTROL_QUICK_STOP   0x0004u /* active low: 0 is a quick stop */
#define CIA402_CONTROL_ENABLE       0x0008u /* enable operation */
#define CIA402_CONTROL_START_HOMING 0x0010u /* homing mode: 1 homes, 0 interrupts */
#define CIA402_CONTROL_FAULT_RESET  0x0080u /* acts at its rising edge */
#define CIA402_CONTROL_HALT         0x0100u /* homing mode: stops until it is 0 */

/* Commands as whole controlwords. */
#define CIA402_DISABLE_VOLTAGE  0x0000u /* to Switch on disabled */
#define CIA402_QUICK_STOP       0x0002u /* to Quick stop active */
#define CIA402_SHUTDOWN         0x0006u /* to Ready to switch on */
#define CIA402_SWITCH_ON        0x0007u /* to Switched on; also: disable operation */
#define CIA402_ENABLE_OPERATION 0x000Fu /* to Operation enabled */
#define CIA402_FAULT_RESET      0x0080u /* from Fault to Switch on disabled */

/* Bits 0 ... 3, 5 (quick stop) and 6 of a statusword identify the state: a number below CIA402_CODES, and its state. */
#define CIA402_CODES        64
#define CIA402_CODE(status) (((status) & 0xFu) | (((unsigned)(status) >> 1) & 0x30u))
extern const uint8_t cia402_states[CIA402_CODES];

/* These bits of a state; and the state of a statusword (codings that do not exist give CIA402_NOT_READY). The second is
 * inline, because each tick calls it for each drive. */
uint16_t cia402_status_bits(enum cia402_state state);
static inline enum cia402_state cia402_decode(uint16_t statusword)
{
    return (enum cia402_state)cia402_states[CIA402_CODE(statusword)];
}

/* English name as in the standard; never NULL. */
const char *cia402_state_name(enum cia402_state state);

#endif
