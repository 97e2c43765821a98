/* SPDX-License-Identifier: MIT */
/* Implements offline/axis_run.h (see there): one axis under given setpoints and offsets, for fits of its plant. Called
 * by host_tools/hodograph/native. Pure, any thread. */
#include "offline/axis_run.h"

#include "plant/influence.h"

int axis_run(const struct drive_config *config, const struct axis_run *run, double *position_mm,
             double *volts)
{
    struct drive drive;
    struct influence influence;
    const int error = drive_init(&drive, config);
    if (error != 0) {
        return error;
    }
    influence_none(&influence, config);
    influence.friction_volts = run->friction_volts;
    drive_place(&drive, run->start_counts);
    for (uint32_t i = 0; i < run->count; i++) {
        influence_offsets(&influence, &drive, config, run->speed_counts_s[i],
                          run->torque_permille[i], run->rated_torque_nm);
        influence_period(&influence, &drive, run->target_counts[i]);
        position_mm[i] = drive.state.motor.position_mm;
        volts[i] = drive.state.volts;
    }
    return 0;
}
