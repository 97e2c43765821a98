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

enum cia402_state {
    CIA402_NOT_READY,
    CIA402_SWITCH_ON_DISABLED,
    CIA402_READY_TO_SWITCH_ON,
    CIA402_SWITCHED_ON,
    CIA402_OPERATION_ENABLED,
    CIA402_QUICK_STOP_ACTIVE,
    CIA402_FAULT_REACTION_ACTIVE,
    CIA402_FAULT
};
#define CIA402_STATES 8

/* Modes of operation, 0x6060 and 0x6061. */
enum cia402_mode { CIA402_MODE_NONE = 0, CIA402_MODE_HOMING = 6, CIA402_MODE_CSP = 8 };

/* Bit of 0x6502 (supported drive modes) for a mode 1 ... 32. */
#define CIA402_SUPPORTS(mode) (UINT32_C(1) << ((mode) - 1))

/* Statusword bits that do not belong to the state. */
#define CIA402_STATUS_VOLTAGE         0x0010u /* power stage is fed */
#define CIA402_STATUS_WARNING         0x0080u
#define CIA402_STATUS_REMOTE          0x0200u /* controlword is followed */
#define CIA402_STATUS_TARGET_REACHED  0x0400u
#define CIA402_STATUS_LIMIT           0x0800u /* internal limit active */
#define CIA402_STATUS_FOLLOWS         0x1000u /* CSP: drive follows the command value */
#define CIA402_STATUS_FOLLOWING_ERROR 0x2000u /* CSP */

/* The same bits in homing mode. */
#define CIA402_STATUS_HOMING_ATTAINED 0x1000u
#define CIA402_STATUS_HOMING_ERROR    0x2000u

/* Controlword bits. */
#define CIA402_CONTROL_SWITCH_ON    0x0001u
#define CIA402_CONTROL_VOLTAGE      0x0002u
#define CIA402_CONTROL_QUICK_STOP   0x0004u /* active low */
#define CIA402_CONTROL_ENABLE       0x0008u
#define CIA402_CONTROL_START_HOMING 0x0010u /* homing mode */
#define CIA402_CONTROL_FAULT_RESET  0x0080u
#define CIA402_CONTROL_HALT         0x0100u

/* Commands as whole controlwords. */
#define CIA402_DISABLE_VOLTAGE  0x0000u
#define CIA402_QUICK_STOP       0x0002u
#define CIA402_SHUTDOWN         0x0006u
#define CIA402_SWITCH_ON        0x0007u /* also: disable operation */
#define CIA402_ENABLE_OPERATION 0x000Fu
#define CIA402_FAULT_RESET      0x0080u

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
