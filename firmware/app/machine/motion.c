/* SPDX-License-Identifier: MIT */
#include "app/machine/motion.h"

#include <string.h>

#include "core/counts.h"
#include "core/program_time.h"

#define FEED_MAX_Q32_MM_S (INT64_MAX / 1000) /* 2^31 um/s */

int motion_begin(struct motion *motion, const struct program *program, const struct config *config)
{
    memset(motion, 0, sizeof *motion);
    motion->counts_per_mm = config->counts_per_mm;
    timebase_begin(&motion->timebase, program, config->period_us);
    return interp_begin(&motion->interp, program, (enum interp_kernel)config->kernel);
}

static void to_counts(const struct motion *motion, const struct interp_point *point,
                      int32_t counts[PLANE_AXES])
{
    counts[0] = counts_from_q40_mm(point->x_q40_mm, motion->counts_per_mm);
    counts[1] = counts_from_q40_mm(point->y_q40_mm, motion->counts_per_mm);
}

int motion_begin_at(struct motion *motion, const struct program *program,
                    const struct config *config, int64_t arc_length_q40_mm,
                    int32_t start_counts[PLANE_AXES])
{
    const int result = motion_begin(motion, program, config);
    if (result < 0) {
        return result;
    }
    const uint64_t time_q42_s = program_time_at_q42(program, arc_length_q40_mm);
    timebase_begin_at(&motion->timebase, program, config->period_us, time_q42_s);
    (void)interp_seek(&motion->interp, time_q42_s >> 10);
    (void)interp_at_q42(&motion->interp, time_q42_s, &motion->point);
    to_counts(motion, &motion->point, start_counts);
    return 0;
}

int motion_step(struct motion *motion, int32_t target_counts[PLANE_AXES])
{
    const uint64_t time_q42_s = timebase_step_q42(&motion->timebase);
    const struct prepared_piece *piece = motion->timebase.record;
    const int result = motion->interp.piece != NULL
                           ? interp_at_piece(&motion->interp, piece, time_q42_s, &motion->point)
                           : interp_at_q42(&motion->interp, time_q42_s, &motion->point);
    if (result < 0) {
        return result;
    }
    motion->setpoints++;
    to_counts(motion, &motion->point, target_counts);
    return 0;
}

void motion_stop(struct motion *motion)
{
    timebase_stop(&motion->timebase);
}

void motion_hold(struct motion *motion)
{
    timebase_hold(&motion->timebase);
}

void motion_resume(struct motion *motion)
{
    timebase_resume(&motion->timebase);
}

void motion_override(struct motion *motion, uint32_t percent)
{
    timebase_override(&motion->timebase, percent);
}

bool motion_held(const struct motion *motion)
{
    return timebase_state(&motion->timebase) == TIMEBASE_HELD;
}

bool motion_over(const struct motion *motion)
{
    const enum timebase_state state = timebase_state(&motion->timebase);
    return state == TIMEBASE_ENDED || state == TIMEBASE_STOPPED;
}

uint64_t motion_time_q32_s(const struct motion *motion)
{
    return (timebase_time_q42(&motion->timebase) + 512u) >> 10;
}

static int64_t saturated(int64_t value, int64_t most)
{
    if (value > most) {
        return most;
    }
    return value < -most ? -most : value;
}

int32_t motion_feed_um_s(const struct motion *motion)
{
    if (motion_over(motion)) {
        return 0;
    }
    /* saturated before each product: below 2^31 um/s times a rate of at most 2^31 stays below 2^62 */
    const int64_t feed_um_s =
        saturated(motion->point.feed_q32_mm_s, FEED_MAX_Q32_MM_S) * 1000 / INT64_C(4294967296);
    const int64_t scaled_um_s =
        feed_um_s * (int64_t)timebase_rate_q30(&motion->timebase) / INT64_C(1073741824);
    return (int32_t)saturated(scaled_um_s, INT32_MAX);
}
