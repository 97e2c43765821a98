/* SPDX-License-Identifier: MIT */
/*
 * Whether there is room for a move of the rate in the pieces ahead: a window in a tick, the narrowest first; part of the
 * timebase. docs/numerics.md section 12, "Windows". Tick context, bounded time.
 */
#ifndef HODOGRAPH_CORE_RATE_SEARCH_H
#define HODOGRAPH_CORE_RATE_SEARCH_H

struct timebase;

enum rate_found {
    RATE_FOUND, /* the plan has goal and ticks of a move, and of the way back where it needs one */
    RATE_FOUND_NOT_YET, /* the next window may do */
    RATE_FOUND_NOTHING, /* no further one will */
};

/* For the kind and the goal of the plan of *tb, from where it is, at rest. */
enum rate_found rate_search(struct timebase *tb);

#endif
