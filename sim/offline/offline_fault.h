/* SPDX-License-Identifier: MIT */
/* offline_fault: faults of the offline simulation: the effect of a rule of docs/reference/protocol.md section 4 on an
 * axis, for the kinds that act on drive or setpoint only. There is no supervision here: an axis continues with its
 * fault where a controller would stop the machine. Used by offline/offline.
 *
 * Ticks count as in the rules: tick 0 is the SYNC at which the first setpoint is latched that differs from the start
 * point. The functions change their arguments only, any thread.
 */
#ifndef HODOGRAPH_OFFLINE_OFFLINE_FAULT_H
#define HODOGRAPH_OFFLINE_OFFLINE_FAULT_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"
#include "plant/influence.h"

#define OFFLINE_FAULT_FOR_EVER UINT32_MAX

enum offline_fault_kind {
    OFFLINE_FAULT_ENCODER_FREEZE, /* the position read stays */
    OFFLINE_FAULT_ENCODER_JUMP,   /* value: bus counts, added to the position read */
    OFFLINE_FAULT_SATURATE, /* value: voltage limit, V, more than 0; the drive's own if that is less */
    OFFLINE_FAULT_LOAD,     /* value: load torque as the voltage it takes, V */
    OFFLINE_FAULT_SETPOINT_LOST, /* setpoints do not arrive: the drive stays with the last one. Those of
                                 a tick are sent in it and latched in the next */
    OFFLINE_FAULT_KINDS          /* how many there are */
};

struct offline_fault {
    enum offline_fault_kind kind;
    uint32_t axis;  /* from 0 */
    uint32_t at;    /* first tick */
    uint32_t ticks; /* how many, 1 or more; OFFLINE_FAULT_FOR_EVER */
    double value;
};

/* Tick number `tick` begins: begins or ends the fault, or changes nothing. To be called for every tick from 0 on. */
void offline_fault_tick(const struct offline_fault *fault, int64_t tick,
                        struct influence *influence, const struct drive *drive);

/* Whether the setpoint that would be latched in this tick is lost. */
bool offline_fault_loses(const struct offline_fault *fault, int64_t tick);

/* Whether a fault can be carried out: kind, length and value are in range. */
bool offline_fault_ok(const struct offline_fault *fault);

#endif
