/* SPDX-License-Identifier: MIT */
/* What drive.c and influence.c share: a period's setpoints, and parking. */
#ifndef HODOGRAPH_PLANT_DRIVE_PRIVATE_H
#define HODOGRAPH_PLANT_DRIVE_PRIVATE_H

#include "plant/drive.h"

/* Setpoints of one period: command at sample i is start + i * step. */
struct drive_command {
    double start_mm;
    double step_mm;
    double speed_mm_s;
};

/* The period's setpoints towards target_counts, which becomes the drive's target. */
struct drive_command drive_command(struct drive *drive, int32_t target_counts);

/* Counts the periods of one target and parks the axis when its time has come, if it may. Returns
 * whether it stays parked. */
bool drive_stays_parked(struct drive *drive, int32_t target_counts, bool may_park);

#endif
