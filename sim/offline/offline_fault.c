/* SPDX-License-Identifier: MIT */
/* Implements offline/offline_fault.h (see there): faults of a run without a bus. Used by offline/offline. Changes its
 * arguments only; any thread. */
#include "offline/offline_fault.h"

#include "core/program.h"

static void offline_fault_begin(const struct offline_fault *fault, struct influence *influence,
                                const struct drive *drive)
{
    switch (fault->kind) {
    case OFFLINE_FAULT_ENCODER_FREEZE:
        influence->encoder_frozen_mm = influence_read_mm(influence, drive);
        influence->encoder_frozen = true;
        break;
    case OFFLINE_FAULT_ENCODER_JUMP:
        influence->encoder_offset_mm += fault->value * drive->mm_per_count;
        break;
    case OFFLINE_FAULT_SATURATE:
        if (fault->value < drive->pdff.volts_limit) {
            influence->volts_limit = fault->value;
        }
        break;
    case OFFLINE_FAULT_LOAD:
        influence->load_volts = fault->value;
        break;
    default:
        break;
    }
}

static void offline_fault_end(const struct offline_fault *fault, struct influence *influence,
                              const struct drive *drive)
{
    switch (fault->kind) {
    case OFFLINE_FAULT_ENCODER_FREEZE:
        influence->encoder_frozen = false;
        break;
    case OFFLINE_FAULT_ENCODER_JUMP:
        influence->encoder_offset_mm -= fault->value * drive->mm_per_count;
        break;
    case OFFLINE_FAULT_SATURATE:
        influence->volts_limit = drive->pdff.volts_limit;
        break;
    case OFFLINE_FAULT_LOAD:
        influence->load_volts = 0.0;
        break;
    default:
        break;
    }
}

static int64_t offline_fault_after(const struct offline_fault *fault)
{
    return fault->ticks == OFFLINE_FAULT_FOR_EVER ? INT64_MAX
                                                  : (int64_t)fault->at + (int64_t)fault->ticks;
}

void offline_fault_tick(const struct offline_fault *fault, int64_t tick,
                        struct influence *influence, const struct drive *drive)
{
    if (tick == (int64_t)fault->at) {
        offline_fault_begin(fault, influence, drive);
    } else if (tick == offline_fault_after(fault)) {
        offline_fault_end(fault, influence, drive);
    } else {
        /* continues, or is none of this simulation */
    }
}

bool offline_fault_loses(const struct offline_fault *fault, int64_t tick)
{
    const int64_t sent = tick - 1;
    return fault->kind == OFFLINE_FAULT_SETPOINT_LOST && sent >= (int64_t)fault->at &&
           sent < offline_fault_after(fault);
}

bool offline_fault_ok(const struct offline_fault *fault)
{
    const double least = fault->kind == OFFLINE_FAULT_SATURATE ? 1e-3 : -2147483648.0;
    return (int)fault->kind >= 0 && fault->kind < OFFLINE_FAULT_KINDS &&
           fault->axis < PROGRAM_AXES && fault->ticks >= 1 && fault->value >= least &&
           fault->value <= 2147483647.0;
}
