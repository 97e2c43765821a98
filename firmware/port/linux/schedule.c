/* SPDX-License-Identifier: MIT */
#include "port/linux/schedule.h"

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step)
{
    schedule->period_ns = period_ns;
    schedule->due_ns = now_ns + period_ns;
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

uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns)
{
    schedule->awaiting = false;
    return !schedule->lock_step && now_ns > schedule->due_ns ? now_ns - schedule->due_ns : 0u;
}

void schedule_finish(struct schedule *schedule, uint64_t started_ns)
{
    if (schedule->awaiting) {
        schedule->due_ns = started_ns + schedule->guard_ns;
        return;
    }
    const uint64_t earliest_ns = started_ns + schedule->period_ns - schedule->period_ns / 4u;
    schedule->due_ns += schedule->period_ns;
    if (schedule->due_ns < earliest_ns) {
        schedule->due_ns = earliest_ns;
    }
}
