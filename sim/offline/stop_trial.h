/* SPDX-License-Identifier: MIT */
/*
 * stop_trial: executes random sequences of hold, resume, override, stop and fault stop in a program, and compares them
 * with the limits and with the stop time bounds of its stop table. Setpoints only, no drives. Called by
 * host_tools/hodograph/native.
 *
 * A trial begins at a tick of the program at override 100 %, gives up to four commands with up to 60 ticks between
 * them, then a hold, stop or fault stop, and runs to standstill. Velocity, acceleration and jerk are the first to third
 * differences of the setpoints. No heap. Any thread; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_TRIAL_H
#define HODOGRAPH_OFFLINE_STOP_TRIAL_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_search.h"

/* Greatest shares of limits: of the axes' velocity, acceleration and jerk, and of acceleration and jerk along the
 * path. */
struct stop_use {
    double velocity, acceleration, jerk, path_acceleration, path_jerk;
};

/* Identifies a trial: its seed, and its first tick. */
struct stop_case {
    uint64_t seed;
    uint32_t tick;
};

struct stop_trial {
    uint64_t seed;
    uint32_t trials;
    /* program's limits: for everything but fault stops, those along the path for path stops only */
    struct stop_limits hold;
    struct stop_limits fault; /* machine's */
    struct stop_use of_hold;  /* result: in path stops of hold and stop, and in all other motion, */
    struct stop_use of_fault; /* and in fault stops */
    double of_bound[2];       /* greatest stop time over its bound, by enum program_stop_kind */
    double longest_s[2];
    uint32_t measured
        [2]; /* stops whose time was compared: those that were requested while the program ran */
    uint32_t late;            /* stops past their deadline */
    uint32_t failures;        /* of the interpolator, and stops that did not end */
    struct stop_case most;    /* of the trial with the greatest share of a limit, */
    struct stop_case longest; /* of a bound, */
    struct stop_case failed;  /* and of the last that failed */
};

/* Spreads the trials over the ticks of a program with coefficient records. The inputs are seed ... fault; the other
 * fields are results. Returns 0 or an error of the interpolator. */
int stop_trial_run(const struct program *p, struct stop_trial *trial);

/* Executes a single trial: `seed` is its seed, `tick` its first tick. */
int stop_trial_again(const struct program *p, struct stop_trial *trial, uint32_t tick);

#endif
