/* SPDX-License-Identifier: MIT */
/* servo: the CiA 402 part of a simulated drive, without its communication: state machine, modes CSP and homing, stops,
 * supervision, reactions to errors. What each object does: docs/reference/protocol.md section 5.
 *
 * The object dictionary holds its parameters and results; servo_refresh brings the results up to date. One period is
 * servo_step. Called by node/drive_node, node/drive_pdos, node/drive_od and node/node_faults. No I/O, no heap. All
 * functions in one context.
 */
#ifndef NODE_SERVO_H
#define NODE_SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402_device.h"
#include "node/axis_motion.h"
#include "node/axis_stop.h"
#include "node/drive_errors.h"
#include "node/drive_homing.h"
#include "node/equipment.h"
#include "node/supervision.h"
#include "od_drive.h"

/* Tests may read all of it; the PDOs set `setpoint_fresh`, injected faults change `axis.influence` and
 * `supervision`. */
struct servo {
    struct od_drive *values; /* borrowed: the object dictionary */
    struct cia402_device device;
    struct axis_motion axis;
    struct equipment equipment;
    struct drive_homing homing;
    struct axis_stop stop;
    struct supervision supervision;
    struct drive_errors errors;
    bool enabled_now;      /* Operation enabled has begun: for the owner's clock, who clears it */
    bool setpoint_fresh;   /* a target came since the last period */
    bool offsets_act;      /* the last period had a feedforward */
    bool limit_switch_hit; /* the reason of the present stop */
    bool software_limit;   /* the setpoint is outside 0x607D */
};

/* All zero before. `values` must stay valid. The axis stands at a position, with the equipment of equipment_init.
 * Returns 0 or an enum drive_error. servo_power_on is next. */
int servo_init(struct servo *servo, const struct drive_config *config, int32_t position_counts,
               struct od_drive *values);

/* Other equipment; of a range that equipment_ok has accepted. */
void servo_equip(struct servo *servo, const struct equipment *equipment);

/* As after power-on; the values have their defaults. A motor that moves coasts with its brake closed in the next
 * periods. A failed encoder or supply stays failed, and the axis stays homed. */
void servo_power_on(struct servo *servo);

/* After servo_power_on, when errors can be reported: a failed encoder or supply is an error again. */
void servo_check_causes(struct servo *servo);

/* A controlword, from RPDO or SDO: 0x6040. */
void servo_control(struct servo *servo, uint16_t controlword);

/* Whether the axis permits another mode: it is at standstill, and neither follows setpoints nor homes. */
bool servo_mode_may_change(const struct servo *servo);

/* Takes 0x6060 over into 0x6061 when the axis permits it. */
void servo_take_mode(struct servo *servo);

/* One period of the axis, by state and mode. */
void servo_step(struct servo *servo);

/* Results in the object dictionary, up to date: the switches; the few that each SYNC needs; all. */
void servo_refresh_inputs(struct servo *servo);
void servo_refresh_cyclic(struct servo *servo);
void servo_refresh(struct servo *servo);

/* Errors, each with its EMCY code. servo_fail: to Fault by 0x605E. servo_fail_powerless: to Fault without power at
 * once, for a failed encoder or supply. servo_disconnect: a lost connection, by 0x6007 if the drive is enabled. */
void servo_fail(struct servo *servo, uint16_t code);
void servo_fail_powerless(struct servo *servo, uint16_t code);
void servo_disconnect(struct servo *servo, uint16_t code);

#endif
