/* SPDX-License-Identifier: MIT */
/* Implements port/linux/schedule.h (see there): when the next tick is due. Used by port/linux/interrupts and
 * sim/gateway/pacing. Pure arithmetic on monotonic nanoseconds; the caller's lock guards the struct. */
#include "port/linux/schedule.h"

#include <string.h>

static uint64_t sooner(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns < b_ns ? a_ns : b_ns;
}

static uint64_t later(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step)
{
    schedule->period_ns = period_ns;
    schedule->started_ns = now_ns;
    schedule->nominal_ns = now_ns + period_ns;
    schedule->earliest_ns = schedule->nominal_ns;
    schedule->due_ns = schedule->nominal_ns;
    schedule->guard_ns = 0;
    schedule->counted_ns = now_ns;
    schedule->awaiting = false;
    schedule->hurry = false;
    schedule->lock_step = lock_step;
    schedule->urgent = false;
    memset(&schedule->main_loop, 0, sizeof schedule->main_loop);
    schedule->main_loop.served_ns = now_ns;
    schedule->main_loop.tick_ns = SCHEDULE_YIELD_NS;
    schedule->main_loop.left_ns = SCHEDULE_YIELDS_NS;
}

void schedule_await(struct schedule *schedule, uint64_t guard_ns, bool hurry)
{
    schedule->guard_ns = guard_ns;
    schedule->awaiting = true;
    schedule->hurry = hurry && schedule->lock_step;
}

/* The pause after a tick. A stall is not counted as work: the drives must not be without SYNCs for as long again. */
static void pause_after_work(struct schedule *schedule, uint64_t now_ns)
{
    const uint64_t half_ns = (now_ns - schedule->started_ns) / 2u;
    const uint64_t pause_ns = half_ns < SCHEDULE_PAUSE_MAX_NS ? half_ns : SCHEDULE_PAUSE_MAX_NS;
    schedule->earliest_ns = later(schedule->earliest_ns, now_ns + pause_ns);
}

void schedule_ready(struct schedule *schedule, uint64_t now_ns)
{
    if (!schedule->awaiting) {
        return;
    }
    if (!schedule->hurry) {
        pause_after_work(schedule, now_ns);
    }
    schedule->awaiting = false;
    schedule->due_ns = schedule->earliest_ns;
}

void schedule_wait(struct schedule *schedule, uint64_t now_ns)
{
    if (!schedule->awaiting) {
        return;
    }
    const uint64_t passed_ns = now_ns - schedule->counted_ns;
    const uint64_t slice_ns = passed_ns < SCHEDULE_SLICE_MAX_NS ? passed_ns : SCHEDULE_SLICE_MAX_NS;
    schedule->counted_ns = now_ns;
    schedule->guard_ns -= slice_ns < schedule->guard_ns ? slice_ns : schedule->guard_ns;
    schedule->due_ns = later(schedule->earliest_ns, now_ns + schedule->guard_ns);
}

static uint64_t lateness_ns(const struct schedule *schedule, uint64_t now_ns)
{
    return now_ns > schedule->nominal_ns ? now_ns - schedule->nominal_ns : 0u;
}

uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns)
{
    schedule->started_ns = now_ns;
    schedule->awaiting = false;
    schedule->hurry = false;
    schedule->main_loop.tick_ns = SCHEDULE_YIELD_NS;
    schedule->main_loop.slept_ns = 0;
    return schedule->lock_step ? 0u : lateness_ns(schedule, now_ns);
}

bool schedule_overdue(struct schedule *schedule, uint64_t now_ns, uint32_t sleeps)
{
    struct schedule_main_loop *main_loop = &schedule->main_loop;
    if (sleeps != main_loop->sleeps) {
        main_loop->sleeps = sleeps;
        main_loop->served_ns = now_ns;
        main_loop->judged_ns = 0;
        main_loop->left_ns = SCHEDULE_YIELDS_NS;
    }
    return !schedule->urgent && now_ns - main_loop->served_ns > SCHEDULE_SLEEPLESS_NS;
}

static bool has_its_share(struct schedule_main_loop *main_loop, uint64_t now_ns, uint64_t had_ns)
{
    if (main_loop->judged_ns == 0u) {
        main_loop->judged_ns = now_ns;
        main_loop->had_ns = had_ns;
    }
    return (had_ns - main_loop->had_ns) * SCHEDULE_MAIN_LOOP_SHARE >= now_ns - main_loop->judged_ns;
}

/* Slices as for the guard: a stall of the whole machine gave the main loop nothing. */
static void count_yield(struct schedule_main_loop *main_loop, uint64_t now_ns)
{
    if (main_loop->slept_ns != 0u) {
        const uint64_t slice_ns =
            sooner(now_ns - main_loop->slept_ns, 2u * SCHEDULE_YIELD_SLICE_NS);
        main_loop->tick_ns -= sooner(slice_ns, main_loop->tick_ns);
        main_loop->left_ns -= sooner(slice_ns, main_loop->left_ns);
    }
    main_loop->slept_ns = now_ns;
}

bool schedule_yield(struct schedule *schedule, uint64_t now_ns, uint64_t had_ns)
{
    struct schedule_main_loop *main_loop = &schedule->main_loop;
    if (has_its_share(main_loop, now_ns, had_ns)) {
        return false;
    }
    count_yield(main_loop, now_ns);
    if (main_loop->tick_ns == 0u || main_loop->left_ns == 0u) {
        return false;
    }
    schedule->due_ns = now_ns + SCHEDULE_YIELD_SLICE_NS;
    return true;
}

static void next_by_clock(struct schedule *schedule, uint64_t now_ns)
{
    const uint64_t started_ns = schedule->started_ns;
    const uint64_t period_ns = schedule->period_ns;
    if (lateness_ns(schedule, started_ns) > period_ns) {
        schedule->nominal_ns = started_ns;
    }
    schedule->nominal_ns += period_ns;
    schedule->earliest_ns = later(schedule->nominal_ns, started_ns + period_ns - period_ns / 4u);
    pause_after_work(schedule, now_ns);
}

void schedule_finish(struct schedule *schedule, uint64_t now_ns)
{
    const uint64_t started_ns = schedule->started_ns;
    if (schedule->hurry) {
        schedule->nominal_ns = started_ns;
        schedule->earliest_ns = started_ns;
    } else {
        next_by_clock(schedule, now_ns);
    }
    const uint64_t patience_ns = schedule->awaiting ? schedule->guard_ns : 0u;
    schedule->counted_ns = started_ns;
    schedule->due_ns = later(schedule->earliest_ns, started_ns + patience_ns);
}
