/* SPDX-License-Identifier: MIT */
/*
 * schedule: when the next tick is due. Used by port/linux/interrupts and sim/gateway/pacing. Pure arithmetic on
 * monotonic nanoseconds; the caller's lock guards the struct.
 *
 * Real time: ticks are due a period apart on the clock. A tick that started late is not skipped. Two starts are at
 * least three quarters of a period apart, so that a small lateness is made up over some ticks. After a delay of more
 * than a period the clock of the ticks is set again.
 *
 * A tick may request that the next one waits until all drives are ready (schedule_await), for a guard time at most. The
 * next tick is then late. At fast pace a tick may also request the next one as soon as all are ready. The guard time is
 * counted in slices: while it waits, the thread wakes at least every SCHEDULE_SLICE_NS and calls schedule_wait. A slice
 * of more than SCHEDULE_SLICE_MAX_NS counts as SCHEDULE_SLICE_MAX_NS. So a stall of the whole computer, in which no
 * drive can become ready, counts little.
 *
 * Real-time threads take as much of the processor as they need. On a computer that is too slow for the period, the main
 * loop still has to run. So after each tick there is a pause: half of the time that the tick took until all were ready,
 * 10 ms at most. If a tick takes less than two thirds of a period this changes nothing.
 *
 * Other real-time processes may use all of that pause (simulated drives that process old SYNCs). So the main loop is
 * supervised. If it has not slept for SCHEDULE_SLEEPLESS_NS and has had less than an eighth of the processor since,
 * ticks are delayed, each by SCHEDULE_YIELD_NS at most, until it has got that share. A main loop that computes for long
 * delays no ticks, because it has the processor. One that waits for something else delays ticks for SCHEDULE_YIELDS_NS
 * in all. With real drives (`urgent`) no tick is delayed.
 */
#ifndef PORT_LINUX_SCHEDULE_H
#define PORT_LINUX_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

#define SCHEDULE_SLICE_NS     10000000u
#define SCHEDULE_SLICE_MAX_NS 20000000u
#define SCHEDULE_PAUSE_MAX_NS 10000000u

#define SCHEDULE_SLEEPLESS_NS    20000000u
#define SCHEDULE_YIELD_NS        10000000u
#define SCHEDULE_YIELDS_NS       200000000u
#define SCHEDULE_YIELD_SLICE_NS  1000000u
#define SCHEDULE_MAIN_LOOP_SHARE 8u

/* Processor time of the main loop. */
struct schedule_main_loop {
    uint64_t served_ns; /* when it last slept, or had its share */
    uint64_t judged_ns; /* start of the time in which its share is measured; 0: it is not */
    uint64_t had_ns;    /* its processor time at that start */
    uint64_t slept_ns;  /* when this thread last yielded to it */
    uint64_t tick_ns;   /* by which the present tick may still be delayed */
    uint64_t left_ns;   /* by which ticks may still be delayed in all */
    uint32_t sleeps;    /* how often it has gone to sleep */
};

struct schedule {
    uint64_t period_ns;
    uint64_t started_ns;  /* the present tick */
    uint64_t nominal_ns;  /* of the next tick, on the clock of the ticks */
    uint64_t earliest_ns; /* when it may start: later than nominal_ns if ticks would be too close */
    uint64_t due_ns;     /* when it has to start: later than earliest_ns while drives are awaited */
    uint64_t guard_ns;   /* the remainder of the guard time */
    uint64_t counted_ns; /* the instant up to which it was counted */
    bool awaiting;       /* drives are awaited since the present tick */
    bool hurry;          /* the next tick is requested as soon as they are ready */
    bool lock_step;      /* whether ticks may be faster than the clock */
    bool urgent;         /* no tick is delayed for the main loop: drives are real */
    struct schedule_main_loop main_loop;
};

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step);

/* Requests of the application: to wait, from inside a tick; and that all are ready, from the receive handler, which has
 * no effect if nothing is awaited. */
void schedule_await(struct schedule *schedule, uint64_t guard_ns, bool hurry);
void schedule_ready(struct schedule *schedule, uint64_t now_ns);

/* The thread has woken: counts the guard time and sets due_ns again. */
void schedule_wait(struct schedule *schedule, uint64_t now_ns);

/* A tick starts: returns its lateness in ns; 0 at fast pace, where nothing is due by the clock. Clears the requests of
 * the last one. */
uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns);

/* Before a due tick; `sleeps` counts how often the main loop has gone to sleep. True if the main loop has not slept for
 * too long: then call schedule_yield. */
bool schedule_overdue(struct schedule *schedule, uint64_t now_ns, uint32_t sleeps);

/* `had_ns`: total processor time of the main loop. True: the tick is delayed, and due_ns is later. */
bool schedule_yield(struct schedule *schedule, uint64_t now_ns, uint64_t had_ns);

/* The tick is over: sets due_ns of the next one. */
void schedule_finish(struct schedule *schedule, uint64_t now_ns);

#endif
