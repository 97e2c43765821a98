/* SPDX-License-Identifier: MIT */
/*
 * override_headroom: what the limits of the axes leave for a changing feed override in each feed piece, from samples of
 * the motion of the axes: docs/theory/feed.md section 7. Called by host_tools/hodograph/native.
 *
 * Samples are grouped in cells. Each cell is a part of one piece. With the override at f, its rate R and its
 * acceleration Q, the rows R v + f^2 a <= A and Q v + 3 f R a + f^3 j <= J hold at each sample, and the voltage limit
 * is kept.
 *
 * Double arithmetic without contraction: the same bits on every computer. No heap. The functions write the caller's
 * arrays only; any thread.
 */
#ifndef HODOGRAPH_NUMERICS_OVERRIDE_HEADROOM_H
#define HODOGRAPH_NUMERICS_OVERRIDE_HEADROOM_H

#include <stdint.h>

/* Samples [axes][cells][samples], 3 or more in a cell, and the limits. mm, s, or degrees of a rotary axis. */
struct override_samples {
    uint32_t axes, cells, samples;
    uint32_t by_sample;   /* 1: `most_...` have the shape of samples, 0: [axes] */
    const int64_t *piece; /* [cells], of each cell */
    /* magnitudes of velocity, acceleration and jerk at an override of 1, above 0 */
    const double *velocity, *acceleration, *jerk;
    const double *most_acceleration, *most_jerk; /* HUGE_VAL: no limit */
    /* of the voltage, |v + time_constant a| <= reach: signed motion, [axes] reach and time constant; NULL: no limit */
    const double *signed_velocity, *signed_acceleration, *reach, *time_constant;
};

/* An override of each piece, [pieces], and its powers. */
struct override_powers {
    const double *first, *second, *third;
};

/* Lowers rest[] and jerk[] of each piece that has samples. rest[]: the greatest override rate that the acceleration and
 * voltage limits allow at this override. jerk[]: the greatest override rate that the jerk limits allow if the override
 * acceleration is 0. A negative value: a limit is exceeded without any change of the override. */
void override_rates(const struct override_samples *samples, const struct override_powers *at,
                    double *rest, double *jerk);

/* Lowers second[] to the greatest override acceleration at this override with the override rates rate[]. */
void override_seconds(const struct override_samples *samples, const struct override_powers *at,
                      const double *rate, double *second);

#endif
