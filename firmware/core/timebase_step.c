/* SPDX-License-Identifier: MIT */
#include "core/timebase.h"
#include "core/timebase_private.h"

static void end(struct timebase *tb)
{
    tb->time_q42_s = tb->duration_q42_s;
    tb->rest = 0;
    tb->fine = 0;
    tb->state = TIMEBASE_ENDED;
    tb->steady = 0;
}

/* The end of the present piece has been reached. */
static uint64_t pass_end(struct timebase *tb, uint64_t time_q42_s)
{
    if (time_q42_s >= tb->duration_q42_s) {
        end(tb);
        return tb->duration_q42_s;
    }
    timebase_find_piece(tb, time_q42_s, TIMEBASE_MOST_ENDS);
    return time_q42_s;
}

uint64_t timebase_step_q42(struct timebase *tb)
{
    if (tb->steady != 0) { /* nothing is on its way: the same again */
        timebase_advance_even(tb);
    } else if (tb->started != 0) {
        timebase_change(tb);
    } else {
        return timebase_start(tb);
    }
    const uint64_t time_q42_s = timebase_rounded_q42(tb);
    return time_q42_s < tb->piece_end_q42_s ? time_q42_s : pass_end(tb, time_q42_s);
}
