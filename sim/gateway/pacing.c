/* SPDX-License-Identifier: MIT */
/* Implements gateway/pacing.h (see there): when a request of the emulated board is answered, so that its ticks come at
 * the times of the Linux port (port/linux/schedule.h). Used by gateway/fifo_side. Pure arithmetic on monotonic
 * nanoseconds. */
#include "gateway/pacing.h"

#define SLEEP_MAX_NS 100000000u /* latest check for signals */

/* At lock step the board continues by itself when all have answered. */
static void begin_tick(struct pacing *pacing, const struct exchange_header *request,
                       uint64_t now_ns)
{
    struct schedule *schedule = &pacing->schedule;
    const uint64_t period_ns = 1000ull * request->period_us;
    if (!pacing->begun) {
        schedule_begin(schedule, now_ns - period_ns, period_ns, false);
        pacing->begun = true;
    }
    if (!pacing->started) {
        (void)schedule_start(schedule, now_ns);
    }
    pacing->started = false;
    schedule->period_ns = period_ns;
    schedule->lock_step = (request->flags & EXCHANGE_HURRY) != 0u;
    if ((request->flags & EXCHANGE_AWAIT) != 0u) {
        schedule_await(schedule, 1000ull * request->guard_us, schedule->lock_step);
    }
    schedule_finish(schedule, now_ns);
}

void pacing_request(struct pacing *pacing, const struct exchange_header *request, uint64_t now_ns)
{
    if ((request->flags & EXCHANGE_TICK) != 0u) {
        begin_tick(pacing, request, now_ns);
    } else if ((request->flags & EXCHANGE_READY) != 0u) {
        schedule_ready(&pacing->schedule, now_ns);
    }
    pacing->at_once = (request->flags & (EXCHANGE_FILTER | EXCHANGE_END)) != 0u;
    pacing->awaiting = (request->flags & EXCHANGE_AWAIT) != 0u;
}

uint64_t pacing_wait_ns(const struct pacing *pacing, uint64_t now_ns)
{
    const struct schedule *schedule = &pacing->schedule;
    if (pacing->at_once || schedule->due_ns <= now_ns) {
        return 0;
    }
    const uint64_t longest_ns = pacing->awaiting ? SCHEDULE_SLICE_NS : SLEEP_MAX_NS;
    const uint64_t wait_ns = schedule->due_ns - now_ns;
    return wait_ns < longest_ns ? wait_ns : longest_ns;
}

bool pacing_over(struct pacing *pacing, uint32_t frames, uint64_t now_ns,
                 struct exchange_header *reply)
{
    reply->flags = 0;
    reply->late_ns = 0;
    if (pacing->at_once) {
        return true;
    }
    schedule_wait(&pacing->schedule, now_ns);
    if (pacing->awaiting && frames > 0u) {
        return true;
    }
    if (now_ns < pacing->schedule.due_ns) {
        return false;
    }
    pacing->schedule.lock_step = false;
    const uint64_t late_ns = schedule_start(&pacing->schedule, now_ns);
    pacing->started = true;
    reply->flags = EXCHANGE_DUE;
    reply->late_ns = late_ns < UINT32_MAX ? (uint32_t)late_ns : UINT32_MAX;
    return true;
}
