/* SPDX-License-Identifier: MIT */
/*
 * Whether there is room for a move of the rate in the pieces ahead: a window in a tick, the narrowest first; part of the
 * timebase. docs/theory/numerics.md section 12, "Look-ahead windows". Tick context, bounded time.
 */
#ifndef HODOGRAPH_CORE_RATE_SEARCH_H
#define HODOGRAPH_CORE_RATE_SEARCH_H

struct program_override;
struct timebase;

/* Looks at the next window (there is one) for the kind and the goal of the plan of *tb, from where it is, at rest. The
 * plan's task is then to begin, with goal and ticks of a move and of the way back where it needs one; or to look at the
 * window after that; or what rate_plan_give_up makes of it. */
void rate_search(struct timebase *tb);

/* Goal and ticks of the first stage from the present rate to the target of the plan, inside these bounds. */
void rate_search_stage(struct timebase *tb, const struct program_override *bounds);

#endif
