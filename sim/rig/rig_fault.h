/* SPDX-License-Identifier: MIT */
/* Faults of a run without a bus: what a rule of docs/reference/protocol.md section 4 does to an axis, for the
 * kinds that act on drive or setpoint alone. Nobody supervises here: an axis goes on under its fault
 * where a controller would stop the machine.
 *
 * Ticks count as they do in the rules: tick 0 is the SYNC at which the first setpoint is latched
 * that differs from the start point. Pure functions but for what they are given.
 */
#ifndef HODOGRAPH_RIG_RIG_FAULT_H
#define HODOGRAPH_RIG_RIG_FAULT_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"
#include "plant/influence.h"

#define RIG_FAULT_FOR_EVER UINT32_MAX

enum rig_fault_kind {
    RIG_FAULT_ENCODER_FREEZE, /* the position read stays */
    RIG_FAULT_ENCODER_JUMP,   /* value: bus counts, added to the position read */
    RIG_FAULT_SATURATE, /* value: voltage limit, V, more than 0; the drive's own if that is less */
    RIG_FAULT_LOAD,     /* value: load torque as the voltage it takes, V */
    RIG_FAULT_SETPOINT_LOST, /* setpoints do not arrive: the drive stays with the last one. Those of
                                 a tick are sent in it and latched in the next */
    RIG_FAULT_KINDS
};

struct rig_fault {
    enum rig_fault_kind kind;
    uint32_t axis;  /* 0, 1 */
    uint32_t at;    /* first tick */
    uint32_t ticks; /* how many, 1 or more; RIG_FAULT_FOR_EVER */
    double value;
};

/* Tick number `tick` begins: the fault begins, ends, or nothing changes. Every tick from 0 on has to
 * be told. */
void rig_fault_tick(const struct rig_fault *fault, int64_t tick, struct influence *influence,
                    const struct drive *drive);

/* Whether the setpoint that would be latched in this tick is lost. */
bool rig_fault_loses(const struct rig_fault *fault, int64_t tick);

/* Whether a fault can be carried out: kind, axis, length and value are in range. */
bool rig_fault_ok(const struct rig_fault *fault);

#endif
