/* SPDX-License-Identifier: MIT */
#include "app/motion.h"

#include <string.h>

#include "core/counts.h"

int motion_begin(struct motion *motion, const struct program *program, const struct config *config)
{
    memset(motion, 0, sizeof *motion);
    motion->counts_per_mm = config->counts_per_mm;
    timebase_begin(&motion->timebase, program, config->period_us);
    return interp_begin(&motion->interp, program, (enum interp_kernel)config->kernel);
}

int motion_step(struct motion *motion, int32_t target_counts[PLANE_AXES])
{
    const uint64_t time_q32_s = timebase_step(&motion->timebase);
    const int result =
        interp_at_q42(&motion->interp, timebase_time_q42(&motion->timebase), &motion->point);
    if (result < 0) {
        return result;
    }
    motion->time_q32_s = time_q32_s;
    motion->setpoints++;
    target_counts[0] = counts_from_q40_mm(motion->point.x_q40_mm, motion->counts_per_mm);
    target_counts[1] = counts_from_q40_mm(motion->point.y_q40_mm, motion->counts_per_mm);
    return 0;
}

void motion_stop(struct motion *motion)
{
    timebase_stop(&motion->timebase);
}

bool motion_over(const struct motion *motion)
{
    const enum timebase_state state = timebase_state(&motion->timebase);
    return state == TIMEBASE_ENDED || state == TIMEBASE_STOPPED;
}

int32_t motion_feed_um_s(const struct motion *motion)
{
    if (motion_over(motion)) {
        return 0;
    }
    const int64_t feed_um_s = motion->point.feed_q32_mm_s * 1000 / INT64_C(4294967296);
    return (int32_t)(feed_um_s * (int64_t)timebase_rate_q30(&motion->timebase) /
                     INT64_C(1073741824));
}
