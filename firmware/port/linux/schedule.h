/* SPDX-License-Identifier: MIT */
/*
 * schedule: when the next tick is due. Pure arithmetic on monotonic nanoseconds.
 *
 * Real time: ticks are due a period apart on the clock. A tick that started late is not skipped and the following ones
 * are not bunched: two starts are at least three quarters of a period apart, so that a small lateness is made up over
 * some ticks. After a delay of more than a period the clock of the ticks is set again.
 *
 * A tick may request that the next one waits until everybody is ready (schedule_await), for a guard time at most: it is
 * then late rather than on time. At lock step it may also request it as soon as that. The guard time is counted in
 * slices: the thread wakes at least every SCHEDULE_SLICE_NS while it waits and says so (schedule_wait); a slice that
 * took longer than SCHEDULE_SLICE_MAX_NS counts as that. So a stall of the whole machine, in which nobody could have
 * become ready, counts little.
 *
 * Real-time threads take all they ask for. So that the main loop still gets its turn on a machine too slow for the
 * period, what a tick took, up to the moment when everybody was ready, is followed by a rest of half of that (10 ms at
 * most). Where a tick takes less than two thirds of a period this changes nothing.
 *
 * That rest is no promise: whoever else runs at real-time priority (the simulated drives, behind with their SYNCs while
 * nobody waits for their answers) may take all of it. So the main loop is watched: when it has not gone to sleep for
 * SCHEDULE_TURN_NS, and has had less than an eighth of the processor since, ticks are put off, each by
 * SCHEDULE_YIELD_NS at most, until it has had its turn. A main loop that computes for long does not delay ticks, as it
 * has the processor; one that is stuck somewhere does so for SCHEDULE_YIELDS_NS, no longer. Where drives are real
 * (`urgent`) none is put off.
 */
#ifndef PORT_LINUX_SCHEDULE_H
#define PORT_LINUX_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

#define SCHEDULE_SLICE_NS     10000000u
#define SCHEDULE_SLICE_MAX_NS 20000000u
#define SCHEDULE_REST_MAX_NS  10000000u

#define SCHEDULE_TURN_NS         20000000u
#define SCHEDULE_YIELD_NS        10000000u
#define SCHEDULE_YIELDS_NS       200000000u
#define SCHEDULE_YIELD_SLICE_NS  1000000u
#define SCHEDULE_MAIN_LOOP_SHARE 8u

/* How the main loop fares. */
struct schedule_main_loop {
    uint64_t turn_ns;   /* when it was last seen to have had its turn */
    uint64_t judged_ns; /* since when its share is judged; 0: not judged */
    uint64_t had_ns;    /* what it had had of the processor then */
    uint64_t slept_ns;  /* when this thread last gave way */
    uint64_t tick_ns;   /* how long the present tick may still be put off */
    uint64_t left_ns;   /* and ticks all in all, until it has had its turn */
    uint32_t turns;
};

struct schedule {
    uint64_t period_ns;
    uint64_t started_ns;  /* the present tick */
    uint64_t nominal_ns;  /* of the next tick, on the clock of the ticks */
    uint64_t earliest_ns; /* when it may start: later than nominal_ns where ticks would bunch */
    uint64_t due_ns;      /* when it has to start: later than that while somebody is waited for */
    uint64_t guard_ns;    /* the remainder of the requested waiting */
    uint64_t counted_ns;  /* up to when it was counted */
    bool awaiting;        /* somebody is waited for, since the present tick */
    bool hurry;           /* its other request */
    bool lock_step;       /* whether ticks may be faster than the clock */
    bool urgent;          /* none is put off for the main loop: drives are real */
    struct schedule_main_loop main_loop;
};

void schedule_begin(struct schedule *schedule, uint64_t now_ns, uint64_t period_ns, bool lock_step);

/* Requests of the application, from inside a tick; and from the receive handler, without effect where nobody is waited
 * for (any more). */
void schedule_await(struct schedule *schedule, uint64_t guard_ns, bool hurry);
void schedule_ready(struct schedule *schedule, uint64_t now_ns);

/* The thread has woken: counts the guard time, moves due_ns along. */
void schedule_wait(struct schedule *schedule, uint64_t now_ns);

/* A tick starts: returns its lateness in ns; 0 at lock step, where nothing is due by the clock. Clears the requests of
 * the last one. */
uint64_t schedule_start(struct schedule *schedule, uint64_t now_ns);

/* Before a due tick; `turns` counts how often the main loop has gone to sleep. True when it is overdue: then ask
 * schedule_yield, too. */
bool schedule_overdue(struct schedule *schedule, uint64_t now_ns, uint32_t turns);

/* `had_ns`: processor time of the main loop, all in all. True: the tick is put off, due_ns moved. */
bool schedule_yield(struct schedule *schedule, uint64_t now_ns, uint64_t had_ns);

/* The tick is over: sets due_ns of the next one. */
void schedule_finish(struct schedule *schedule, uint64_t now_ns);

#endif
