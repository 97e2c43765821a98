/* SPDX-License-Identifier: MIT */
/*
 * axis: one drive as the tick sees it: what it last said, where it is wanted, what it is sent.
 *
 * Guarded by the port's lock: written by the receive and timer interrupts, read by the mainline in
 * a critical section. Positions in counts.
 */
#ifndef APP_AXIS_H
#define APP_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/cia402_master.h"
#include "canopen/pdo.h"

/* A drive is lost after so many SYNCs in a row without an answer; or after fewer, when they took long: so at lock
 * step, where every one of them is waited for. A host that stalls sends no SYNCs, so it loses no drive. */
#define AXIS_MISSED_LOST      100u
#define AXIS_MISSED_MAX       10u
#define AXIS_SILENCE_MAX_US   1000000u
#define AXIS_STANDSTILL_SYNCS 250u

struct axis {
    uint8_t node;
    bool present;  /* has answered a SYNC since it was configured */
    bool answered; /* has answered the present SYNC */
    uint16_t statusword;
    uint16_t controlword; /* sent last */
    uint16_t
        control_extra;   /* more controlword bits while the drive is told to be enabled: homing */
    uint16_t error_code; /* of the drive's last EMCY; 0: none */
    int32_t position_counts;
    int32_t target_counts;      /* to be sent in this tick */
    int32_t target_sent_counts; /* sent in the last one */
    enum cia402_goal goal;
    uint32_t answered_us; /* port_time_us() of the last answer */
    uint32_t missed_in_row;
    uint32_t missed;                /* SYNCs unanswered since it was found */
    uint32_t digital_inputs;        /* 0x60FD */
    int32_t following_error_counts; /* 0x60F4, looked at a few times a second */
    bool homed;                     /* since it was found */
    uint32_t still_syncs; /* for how long it has stood still, enabled, at an unchanged target */
};

void axis_init(struct axis *axis, uint8_t node);

/* Takes the drive's TPDO1. Receive. */
void axis_receive(struct axis *axis, const struct pdo_actual *actual, uint32_t now_us);

/* A SYNC is over: returns true when the drive has not answered it. Timer. */
bool axis_close_sync(struct axis *axis);

/* Makes the setpoint frame of this tick. While the drive is not yet commanded to follow, its target
 * follows its position, so that switching on moves nothing. Timer. */
void axis_setpoint(struct axis *axis, uint32_t tolerance_counts, struct can_msg *out);

/* All pure, under the lock. */
bool axis_lost(const struct axis *axis, uint32_t now_us);
bool axis_in_fault(const struct axis *axis); /* Fault, or on the way there */
bool axis_enabled(const struct axis *axis);  /* Operation enabled */
bool axis_reached(const struct axis *axis);  /* at its goal */
bool axis_still(const struct axis *axis);

/* Distance of both target and position from a place, whichever is larger. */
uint32_t axis_distance(const struct axis *axis, int32_t place_counts);

#endif
