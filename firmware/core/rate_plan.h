/* SPDX-License-Identifier: MIT */
/*
 * Which way the rate goes in the next tick, with a way to a safe rest always at hand; part of the
 * timebase. docs/numerics.md section 12, "Always a way out". Tick context, bounded time.
 */
#ifndef HODOGRAPH_CORE_RATE_PLAN_H
#define HODOGRAPH_CORE_RATE_PLAN_H

#include "core/timebase.h"

/* Slope at the end of the next tick; keeps the plan of *tb up to date and its `saturated`. */
int64_t rate_plan_slope(struct timebase *tb);

/* 1 when the rate is where it is wanted and may stay there whatever the pieces are: the next tick is like this one. */
int rate_plan_steady(const struct timebase *tb);

#endif
