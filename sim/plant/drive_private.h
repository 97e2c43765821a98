/* SPDX-License-Identifier: MIT */
/* What drive.c and influence.c share: a period's setpoints, and parking. */
#ifndef HODOGRAPH_PLANT_DRIVE_PRIVATE_H
#define HODOGRAPH_PLANT_DRIVE_PRIVATE_H

#include "plant/drive.h"

/* Setpoints of one period, at the beginning of sample i. Linear: start + i * step, at a constant speed.
 * Cubic: with u = i / samples, start + u (way[0] + u (way[1] + u way[2])). */
struct drive_command {
    double start_mm;
    double step_mm;
    double speed_mm_s;
    bool cubic;
    double fraction; /* 1 / samples per period */
    double per_s;    /* periods a second */
    double way_mm[3];
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
    input->command_mm = c->start_mm + u * (c->way_mm[0] + u * (c->way_mm[1] + u * c->way_mm[2]));
    input->command_mm_s =
        (c->way_mm[0] + u * (2.0 * c->way_mm[1] + 3.0 * u * c->way_mm[2])) * c->per_s;
}

/* The speed that the loop sees at a sample, rad/s; notes the reading. */
static inline double drive_speed(const struct drive *d, struct drive_state *state, double read_mm)
{
    const double way_mm = read_mm - state->read_mm;
    state->read_mm = read_mm;
    return d->speed_per_way == 0.0 ? state->motor.speed_rad_s : way_mm * d->speed_per_way;
}

/* The volts of the sample that begins, when these have been computed in it. */
static inline double drive_volts(const struct drive *d, struct drive_state *state, double computed)
{
    const double before = state->next_volts;
    state->next_volts = computed;
    return d->delayed ? before : computed;
}

/* The period's setpoints towards target_counts, which becomes the drive's target. */
struct drive_command drive_command(struct drive *drive, int32_t target_counts);

/* Counts the periods of one target and parks the axis when its time has come, if it may. Returns
 * whether it stays parked. */
bool drive_stays_parked(struct drive *drive, int32_t target_counts, bool may_park);

#endif
