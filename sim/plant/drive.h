/* SPDX-License-Identifier: MIT */
/* drive: one simulated servo axis in cyclic synchronous position mode: setpoint interpolation, PDFF loop, motor, screw,
 * encoder. No CAN and no clock: the caller advances it by whole bus periods. Called by plant/influence, sim/node,
 * sim/offline and host tools. Model: docs/theory/drives.md section 13. Changes only its struct; no I/O.
 *
 * Use: drive_init, then drive_place (or drive_hold), then for every SYNC j: report
 * drive_position_counts and drive_volts_mv (they are those of the instant of SYNC j), latch the
 * setpoint received since SYNC j-1 and call drive_period with it; the axis is commanded to be there
 * at SYNC j+1, in a straight line from the setpoint before, or along a cubic whose speed has no jumps. A drive without
 * interpolation commands it at once, at SYNC j.
 *
 * Standstill lock, called parking here (docs/reference/protocol.md section 3): an axis that has had one target for
 * DRIVE_PARK_PERIODS periods and reads within DRIVE_PARK_INCREMENTS encoder increments of it is set exactly to
 * standstill at the target, with an empty integrator. So its later motion depends on the target alone, not on its
 * history.
 *
 * Arithmetic is double, in a fixed order, with + - * / only (compile with -ffp-contract=off): the
 * same bits on every IEEE 754 target. No heap, no I/O. One thread for each struct drive.
 */
#ifndef HODOGRAPH_PLANT_DRIVE_H
#define HODOGRAPH_PLANT_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive_config.h"
#include "plant/encoder.h"
#include "plant/motor.h"
#include "plant/pdff.h"

#define DRIVE_PARK_PERIODS    250 /* of the standstill lock, see above */
#define DRIVE_PARK_INCREMENTS 2

/* What changes from servo sample to servo sample. */
struct drive_state {
    struct motor_state motor;
    double integral_rad;
    double volts; /* held over the last sample */
    /* Of drives with speed from differences, and with a delay: */
    double read_mm;    /* at the last sample */
    double next_volts; /* computed in the last sample, for the next */
};

/* Fields are for this module and influence.h; others read through the functions below. */
struct drive {
    struct motor motor;
    struct encoder encoder;
    struct pdff pdff;
    double mm_per_count;
    double counts_per_mm;
    double sample_fraction; /* 1 / samples per period */
    double samples_per_s;
    uint32_t samples;
    struct drive_state state;
    bool plain; /* no cubic interpolation, exact speed, no delay */
    bool cubic; /* interpolation */
    bool steps; /* no interpolation */
    bool delayed;
    /* rad/s for a mm of difference between two samples; 0: exact speed */
    double speed_per_distance;
    /* of the last period, and what the command does in a period at the speed it */
    double distance_counts;
    double end_distance_counts; /* had at the end of that; both for cubic interpolation */
    int32_t target_counts;
    uint32_t same_target_periods; /* up to DRIVE_PARK_PERIODS */
    bool parked;
};

/* Checks the configuration and prepares the coefficients; the axis is parked at 0 counts. Returns 0
 * or a negative enum drive_error; on error the object is not to be used. */
int drive_init(struct drive *drive, const struct drive_config *config);

/* Places the axis at standstill, parked at target_counts. */
void drive_place(struct drive *drive, int32_t target_counts);

/* Drive not enabled, brake closed: the axis is at standstill at its place; the next period starts from the encoder
 * position. */
void drive_hold(struct drive *drive);

/* One bus period towards target_counts. */
void drive_period(struct drive *drive, int32_t target_counts);

/* The same for two axes at once: the same bits as two calls, but their chains of arithmetic overlap
 * in the processor (when both are plain and have the same number of servo samples per period). */
void drive_period_pair(struct drive *first, struct drive *second, const int32_t target_counts[2]);

/* Encoder position in bus counts, rounded to nearest and saturated. */
int32_t drive_position_counts(const struct drive *drive);

/* Volts applied over the last servo sample, in mV as on the bus. */
int16_t drive_volts_mv(const struct drive *drive);

/* Whether the standstill lock holds the axis. */
bool drive_parked(const struct drive *drive);

/* ---- The samples of a period, for callers that compute them themselves (influence.h) ---- */

/* Setpoints of one period, at the beginning of sample i. Linear: start + i * step, at a constant speed; without
 * interpolation the step is 0. Cubic: with u = i / samples, start + u (distance[0] + u (distance[1] + u distance[2])).
 * */
struct drive_command {
    double start_mm;
    double step_mm;
    double speed_mm_s;
    bool cubic;
    double fraction; /* 1 / samples per period */
    double per_s;    /* periods a second */
    double distance_mm[3];
};

static inline void drive_command_at(const struct drive_command *c, uint32_t i,
                                    struct pdff_input *input)
{
    if (!c->cubic) {
        input->command_mm = c->start_mm + (double)i * c->step_mm;
        input->command_mm_s = c->speed_mm_s;
        return;
    }
    const double u = (double)i * c->fraction;
    input->command_mm =
        c->start_mm + u * (c->distance_mm[0] + u * (c->distance_mm[1] + u * c->distance_mm[2]));
    input->command_mm_s =
        (c->distance_mm[0] + u * (2.0 * c->distance_mm[1] + 3.0 * u * c->distance_mm[2])) *
        c->per_s;
}

/* The speed that the loop uses at a sample, rad/s; stores the reading for the next sample. */
static inline double drive_speed(const struct drive *d, struct drive_state *state, double read_mm)
{
    const double distance_mm = read_mm - state->read_mm;
    state->read_mm = read_mm;
    return d->speed_per_distance == 0.0 ? state->motor.speed_rad_s
                                        : distance_mm * d->speed_per_distance;
}

/* The volts of the sample that begins; `computed`: those that the loop has computed in it. */
static inline double drive_volts(const struct drive *d, struct drive_state *state, double computed)
{
    const double before = state->next_volts;
    state->next_volts = computed;
    return d->delayed ? before : computed;
}

/* The period's setpoints towards target_counts, which becomes the drive's target. */
struct drive_command drive_command(struct drive *drive, int32_t target_counts);

/* Counts the periods of one target and parks the axis after DRIVE_PARK_PERIODS, if may_park. Returns whether it is
 * parked. */
bool drive_stays_parked(struct drive *drive, int32_t target_counts, bool may_park);

#endif
