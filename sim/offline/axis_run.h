/* SPDX-License-Identifier: MIT */
/* axis_run: runs one simulated axis with given setpoints and offsets, to fit its plant to a recording. It returns the
 * motion of the motor in the model, before encoder and bus round it; the drive itself uses its encoder as usual. Called
 * by host_tools/hodograph/native. Pure, any thread.
 */
#ifndef HODOGRAPH_OFFLINE_AXIS_RUN_H
#define HODOGRAPH_OFFLINE_AXIS_RUN_H

#include <stdint.h>

#include "plant/drive_config.h"

struct axis_run {
    double rated_torque_nm; /* of torque offsets, more than 0 */
    double friction_volts;  /* Coulomb, 0 or more */
    int32_t start_counts;   /* standstill here */
    uint32_t count;
    /* `count` values each, one for each bus period. */
    const int32_t *target_counts;
    const int32_t *speed_counts_s;  /* 0x60B1 */
    const int16_t *torque_permille; /* 0x60B2 */
};

/* Runs all `count` periods. Writes position and volts (of the last servo sample) at the end of each period. Returns 0
 * or a negative enum drive_error. */
int axis_run(const struct drive_config *config, const struct axis_run *run, double *position_mm,
             double *volts);

#endif
