/* SPDX-License-Identifier: MIT */
/*
 * axis: the state of one drive in the controller: its last reported values, its goal and target, and the setpoint that
 * is sent. Used by firmware/app.
 *
 * Guarded by the port's lock: written by the receive and timer interrupts, read by the main loop in a critical section.
 * Positions in counts. No I/O.
 */
#ifndef APP_MACHINE_AXIS_H
#define APP_MACHINE_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/config.h"
#include "app/machine/statusword_monitor.h"
#include "app/machine/tpdo_monitor.h"
#include "can/can_frame.h"
#include "canopen/cia402_master.h"
#include "canopen/pdo.h"

#define AXIS_STANDSTILL_SYNCS 250u

/* A drive with power on counts as moving until it has been in one place for so long. */
#define AXIS_UNMOVED_SYNCS 50u

/* A drive with power off that stops answering may answer again within this time. Then it counts as lost for long. */
#define AXIS_LOST_FOR_LONG_US 1000000u

struct axis {
    uint8_t node;
    enum cia402_state state; /* by the statusword */
    /* the last answer has Operation enabled, and no wrong bit in the statusword */
    bool statusword_ok;
    struct tpdo_monitor tpdo1;
    struct statusword_monitor statusword_bits;
    uint16_t statusword;
    uint16_t statusword_before; /* the one before it */
    uint16_t controlword;       /* sent last */
    uint16_t control_extra;     /* more controlword bits while the goal is enabled: homing */
    uint16_t error_code;        /* of the drive's last EMCY; 0: none */
    int32_t position_counts;
    int32_t target_counts;      /* to be sent in this tick */
    int32_t target_sent_counts; /* sent in the last one */
    int32_t latched_counts;     /* target that the drive took over at the last SYNC */
    int32_t expected_counts;    /* position that the drive should have had at the last SYNC */
    uint32_t deviation_syncs;   /* answers in a row with a position outside the window around it */
    bool deviates;              /* for longer than the configuration permits */
    /* the last RPDO1 of axis_setpoint: kept, so that only changes are written */
    struct can_msg setpoint;
    enum cia402_goal goal;
    /* it was in Operation enabled since that became the goal: its target does not follow the position */
    bool was_enabled;
    bool moves_by_drive; /* it homes by its own motion: its target follows its position */
    int32_t velocity_offset_counts_s; /* put into its RPDO2 last */
    int16_t torque_offset_permille;   /* put into its RPDO1 last */
    bool torque_mapped;               /* its RPDO1 takes a torque offset */
    bool velocity_mapped;             /* its RPDO2 takes a velocity offset */
    uint32_t digital_inputs;          /* 0x60FD */
    int32_t following_error_counts;   /* 0x60F4, read a few times a second */
    bool homed;                       /* its drive has the zero that homing gave it */
    /* its last position before it was lost or configured again */
    int32_t last_seen_counts;
    uint32_t unmoved_syncs; /* with power on: for how long it has been at this place, */
    int32_t unmoved_counts;
    enum cia402_state unmoved_state; /* in this state */
    /* for how long it has been at standstill, enabled, at an unchanged target */
    uint32_t standstill_syncs;
};

void axis_init(struct axis *axis, uint8_t node);

/* Forgets the drive, which has to be found and configured again. Whether it is homed stays, when the node is the same:
 * that ends only by axis_reconnected, a boot-up message, or missing heartbeats. Under the lock. */
void axis_forget(struct axis *axis, uint8_t node);

/* The drive has been found again and has reported its position. If that is more than `tolerance_counts` from its last
 * known position, the axis is not homed any more. Under the lock. */
void axis_reconnected(struct axis *axis, int32_t position_counts, uint32_t tolerance_counts);

/* A new goal, which ends homing: moves_by_drive and control_extra are cleared. Under the lock. */
void axis_command(struct axis *axis, enum cia402_goal goal);

/* Takes the drive's TPDO1. Receive. */
void axis_receive(struct axis *axis, const struct pdo_actual *actual, uint32_t now_us);

/* The drive has restarted: its last reported values are not valid, and it is not ready to switch on. Under the lock. */
void axis_restarted(struct axis *axis);

/* Makes the setpoint frame of this tick, `setpoint`. Until the drive has been in Operation enabled its target follows
 * its position, so that switching on moves nothing; it stays inside the travel, in which machine_enable lets the axis
 * stand but for the start tolerance. From then on the target changes by commands only, also in a quick
 * stop. When the drive is off, the target follows the position again. Timer. */
void axis_setpoint(struct axis *axis, uint32_t tolerance_counts,
                   const struct config_travel *travel);

/* The port has taken that frame. Timer. */
static inline void axis_sent(struct axis *axis)
{
    axis->target_sent_counts = axis->target_counts;
}

/* A SYNC has left: the drive takes over the target sent last, and should be at the one before. Timer. */
static inline void axis_synced(struct axis *axis)
{
    axis->expected_counts = axis->latched_counts;
    axis->latched_counts = axis->target_sent_counts;
}

/* Compares the answer to the last SYNC with the position expected then, while the drive is to follow its target. It
 * deviates where they are more than window_counts apart in more than syncs_max answers in a row. Timer, before
 * axis_synced. */
void axis_compare(struct axis *axis, uint32_t window_counts, uint32_t syncs_max);

/* All pure, under the lock. */
bool axis_lost_for_long(const struct axis *axis, uint32_t now_us); /* no TPDO1 for so long */
bool axis_in_fault(const struct axis *axis); /* Fault, or Fault reaction active */
bool axis_left_operation_enabled(
    const struct axis *axis); /* was enabled, is to be enabled, and is not */
static inline bool axis_enabled(const struct axis *axis) /* Operation enabled */
{
    return axis->state == CIA402_OPERATION_ENABLED;
}
/* Enabled, answers, is at its expected position, no wrong bit in its statusword. */
static inline bool axis_healthy(const struct axis *axis)
{
    return axis->statusword_ok && !axis->tpdo1.lost && !axis->deviates;
}
bool axis_follows(const struct axis *axis); /* enabled, answers, follows its target */

/* Does not move by its own power: off, in Fault, or in Quick stop active (where a drive without 0x605A may stay) and in
 * one place for AXIS_STANDSTILL_SYNCS. */
bool axis_has_stopped(const struct axis *axis);
bool axis_moves(const struct axis *axis);   /* power is on, and its position has changed lately */
bool axis_reached(const struct axis *axis); /* at its goal; enabled: it follows its target too */
bool axis_stands(const struct axis *axis);  /* at standstill for AXIS_STANDSTILL_SYNCS */

/* Distance between the position and the expected position of the same SYNC. */
uint32_t axis_deviation_counts(const struct axis *axis);

/* Distance of both target and position from a place, whichever is larger. */
uint32_t axis_distance(const struct axis *axis, int32_t place_counts);

#endif
