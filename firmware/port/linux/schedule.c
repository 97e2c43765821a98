/* SPDX-License-Identifier: MIT */
#include "port/linux/schedule.h"

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step)
{
    schedule->period_ns = period_ns;
    schedule->nominal_ns = now_ns + period_ns;
    schedule->due_ns = schedule->nominal_ns;
    schedule->guard_ns = 0;
    schedule->awaiting = false;
    schedule->lock_step = lock_step;
}

void schedule_await(struct schedule *schedule, uint64_t guard_ns)
{
    if (schedule->lock_step) {
        schedule->guard_ns = guard_ns;
        schedule->awaiting = true;
    }
}

void schedule_ready(struct schedule *schedule, uint64_t now_ns)
{
    if (schedule->awaiting && now_ns < schedule->due_ns) {
        schedule->due_ns = now_ns;
    }
}

static uint64_t lateness_ns(const struct schedule *schedule, uint64_t now_ns)
{
    return now_ns > schedule->nominal_ns ? now_ns - schedule->nominal_ns : 0u;
}

uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns)
{
    schedule->awaiting = false;
    return schedule->lock_step ? 0u : lateness_ns(schedule, now_ns);
}

static void next_by_clock(struct schedule *schedule, uint64_t started_ns)
{
    const uint64_t period_ns = schedule->period_ns;
    const uint64_t earliest_ns = started_ns + period_ns - period_ns / 4u;
    if (lateness_ns(schedule, started_ns) > period_ns) {
        schedule->nominal_ns = started_ns;
    }
    schedule->nominal_ns += period_ns;
    schedule->due_ns = schedule->nominal_ns > earliest_ns ? schedule->nominal_ns : earliest_ns;
}

static void next_after(struct schedule *schedule, uint64_t started_ns, uint64_t pause_ns)
{
    schedule->nominal_ns = started_ns + pause_ns;
    schedule->due_ns = schedule->nominal_ns;
}

void schedule_finish(struct schedule *schedule, uint64_t started_ns)
{
    if (!schedule->lock_step) {
        next_by_clock(schedule, started_ns);
    } else if (schedule->awaiting) {
        next_after(schedule, started_ns, schedule->guard_ns);
    } else {
        next_after(schedule, started_ns, schedule->period_ns);
    }
}
