/* SPDX-License-Identifier: MIT */
/*
 * schedule: when the next tick is due. Pure arithmetic on monotonic nanoseconds.
 *
 * Real time: ticks are due a period apart on the clock. A tick that started late is not skipped and
 * the following ones are not bunched: two starts are at least three quarters of a period apart, so
 * that a small lateness is made up over some ticks. After one of more than a period the clock of
 * the ticks is set anew.
 *
 * Lock step (schedule_await): the next tick is due when schedule_ready() is called, else after the
 * guard time.
 */
#ifndef PORT_LINUX_SCHEDULE_H
#define PORT_LINUX_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

struct schedule {
    uint64_t period_ns;
    uint64_t nominal_ns; /* of the next tick, on the clock of the ticks */
    uint64_t due_ns;     /* when it may start: not before nominal_ns */
    uint64_t guard_ns;   /* lock step wished by the present tick; 0: none */
    bool awaiting;       /* the next tick may come before due_ns */
    bool lock_step;      /* whether wishes count */
};

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step);

/* Wishes of the application, from inside a tick and from the receive handler. */
void schedule_await(struct schedule *schedule, uint64_t guard_ns);
void schedule_ready(struct schedule *schedule, uint64_t now_ns);

/* A tick starts: returns its lateness in ns; 0 at lock step, where nothing is due by the clock. Clears the wishes of the last one. */
uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns);

/* The tick that started at started_ns is over: sets due_ns of the next one. */
void schedule_finish(struct schedule *schedule, uint64_t started_ns);

#endif
