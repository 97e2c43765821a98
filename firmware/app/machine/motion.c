/* SPDX-License-Identifier: MIT */
/* Implements app/machine/motion.h: one run of a program. Used by firmware/app. Main loop: app/commands.c and
 * app/stream.c prepare it and hand it to the machine. Then it belongs to the tick (machine_tick.c), under the port's
 * lock. Changes only the motion; no I/O. */
#include "app/machine/motion.h"

#include <string.h>

#include "core/program_time.h"

#define FEED_MAX_Q32_MM_S (INT64_MAX / 1000) /* 2^31 um/s */

int motion_begin(struct motion *motion, const struct program *program, const struct config *config)
{
    memset(motion, 0, sizeof *motion);
    path_counts_init(&motion->scale, program, config);
    const int result = interpolator_begin(&motion->interp, program);
    if (result == 0) {
        feed_override_begin(&motion->feed, program, config->period_us, 0);
        path_outputs_begin(&motion->outputs, program, -1);
    }
    return result;
}

void motion_begin_job(struct motion *motion, const struct chunk *first,
                      const struct coefficients_window *window, const struct config *config)
{
    memset(motion, 0, sizeof *motion);
    path_counts_init(&motion->scale, &first->program, config);
    interpolator_begin_window(&motion->interp, &first->program, window);
    feed_override_begin_job(&motion->feed, first, window, config->period_us);
    path_outputs_begin(&motion->outputs, &first->program, -1);
    motion->joined = chunk_is_joined(first);
}

bool motion_take_over(struct motion *motion, const struct chunk *next,
                      const struct coefficients_window *window)
{
    const struct program *before = motion->interp.program;
    if (feed_override_take_over(&motion->feed, &motion->interp, next, window) == 0) {
        return false;
    }
    if (chunk_begins_at_rest(next)) {
        const uint32_t ticks = chunk_rest_ticks(next);
        motion->rest_ticks = ticks > motion->rested_ticks ? ticks - motion->rested_ticks : 0u;
        motion->rested_ticks = 0;
        motion->point.arc_length_q40_mm = 0;
        motion->precedes = true;
        path_outputs_begin_next(&motion->outputs, &next->program);
    } else {
        motion->point.arc_length_q40_mm -= next->arc_shift_q40_mm;
        path_outputs_carry(&motion->outputs, before, &next->program, next->arc_shift_q40_mm);
    }
    motion->joined = chunk_is_joined(next);
    return true;
}

int motion_begin_at(struct motion *motion, const struct program *program,
                    const struct config *config, int64_t arc_length_q40_mm,
                    int32_t start_counts[AXES_MAX])
{
    const int result = motion_begin(motion, program, config);
    if (result < 0) {
        return result;
    }
    const uint64_t time_q42_s = program_time_at_q42(program, arc_length_q40_mm);
    feed_override_begin(&motion->feed, program, config->period_us, time_q42_s);
    (void)interpolator_seek(&motion->interp, time_q42_s >> 10);
    (void)interpolator_at_q42(&motion->interp, time_q42_s, &motion->point);
    path_outputs_begin(&motion->outputs, program, arc_length_q40_mm);
    path_counts_of(&motion->scale, &motion->point, start_counts);
    return 0;
}

bool motion_rests(struct motion *motion)
{
    const bool runs = feed_override_state(&motion->feed) == FEED_RUNNING;
    if (!motion_waits(motion)) {
        motion->rested_ticks = 0;
    } else if (runs && motion->rested_ticks < UINT32_MAX) {
        motion->rested_ticks++;
    }
    if (motion->rest_ticks == 0u || !runs) {
        return false;
    }
    motion->rest_ticks--;
    motion->setpoints++;
    return true;
}

int motion_step(struct motion *motion, int32_t target_counts[AXES_MAX])
{
    const int result = feed_override_next(&motion->feed, &motion->interp, &motion->point);
    if (result < 0) {
        return result;
    }
    motion->setpoints++;
    motion->precedes = false;
    path_counts_of(&motion->scale, &motion->point, target_counts);
    return 0;
}

void motion_stop(struct motion *motion)
{
    feed_override_stop(&motion->feed);
}

void motion_fault_stop(struct motion *motion)
{
    feed_override_fault_stop(&motion->feed);
}

void motion_hold(struct motion *motion)
{
    feed_override_hold(&motion->feed);
}

void motion_resume(struct motion *motion)
{
    feed_override_resume(&motion->feed);
}

void motion_override(struct motion *motion, uint32_t percent)
{
    feed_override_set(&motion->feed, percent);
}

bool motion_held(const struct motion *motion)
{
    return feed_override_state(&motion->feed) == FEED_HELD;
}

bool motion_waits(const struct motion *motion)
{
    return feed_override_waits(&motion->feed) != 0 && !motion_over(motion);
}

bool motion_misses_chunk(const struct motion *motion)
{
    return !motion->joined && !motion->precedes && motion_waits(motion);
}

bool motion_late(const struct motion *motion)
{
    return feed_override_late(&motion->feed) != 0;
}

bool motion_over(const struct motion *motion)
{
    const enum feed_state state = feed_override_state(&motion->feed);
    return state == FEED_ENDED || state == FEED_STOPPED;
}

uint64_t motion_time_q32_s(const struct motion *motion)
{
    return (feed_override_time_q42(&motion->feed) + 512u) >> 10;
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
    const int64_t feed_q32 = saturated(feed_override_feed_q32(&motion->feed), FEED_MAX_Q32_MM_S);
    return (int32_t)saturated(feed_q32 * 1000 / INT64_C(4294967296), INT32_MAX);
}
