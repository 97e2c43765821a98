/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_trial.h (see there): random sequences of commands, and whether their stops keep limits and
 * bounds. Called by host_tools/hodograph/native. Any thread; the functions change their arguments only. */
#include "offline/stop_trial.h"

#include <math.h>
#include <string.h>

#include "core/feed_override.h"
#include "core/interpolator.h"

#define MOST_COMMANDS 4u      /* before the stop that ends a trial */
#define MOST_BETWEEN  60u     /* ticks between two commands */
#define MOST_TICKS    200000u /* of the motion after the stop command */
#define HISTORY       3u      /* setpoints before the newest: a third difference needs them */
#define NOISE_MM_S3   20.0 /* of a kernel in third differences at 1 kHz; docs/theory/proofs.md 16 */

#define ARC PROGRAM_AXES /* after the axes of a setpoint: its arc length */

/* A motion under commands, with its last setpoints: path axes and arc length in mm. */
struct course {
    struct feed_override feed;
    struct interpolator interp;
    double points[HISTORY + 1u][PROGRAM_AXES + 1u]; /* the newest first */
    uint32_t count;
    uint32_t brake_ticks; /* of the path stop up to now; 0: none */
    double begun_with;    /* acceleration along the path when it began */
    int machine;          /* 1: a fault stop: the machine's limits count */
};

static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static uint32_t below(uint64_t *state, uint32_t count)
{
    return (uint32_t)(next_random(state) >> 32) % count;
}

static void grow(double *most, double value)
{
    *most = value > *most ? value : *most;
}

/* --- A tick, compared with the limits --- */

static void differences(const struct course *course, uint32_t axis, double period_s, double out[3])
{
    double p[HISTORY + 1u];
    for (uint32_t i = 0; i <= HISTORY; i++) {
        p[i] = course->points[i][axis];
    }
    out[0] = (p[0] - p[1]) / period_s;
    out[1] = (p[0] - 2.0 * p[1] + p[2]) / (period_s * period_s);
    out[2] = (p[0] - 3.0 * (p[1] - p[2]) - p[3]) / (period_s * period_s * period_s);
}

static void evaluate_axes(const struct course *course, double period_s,
                          const struct stop_limits *limits, struct stop_use *use)
{
    for (uint32_t axis = 0; axis < course->interp.axis_count; axis++) {
        double d[3];
        differences(course, axis, period_s, d);
        grow(&use->velocity, fabs(d[0]) / limits->axis_velocity[axis]);
        grow(&use->acceleration, fabs(d[1]) / limits->axis_acceleration[axis]);
        grow(&use->jerk, fabs(d[2]) / (limits->axis_jerk[axis] + NOISE_MM_S3));
    }
}

/* Differences include earlier ticks: those of a path stop alone are the ones from its fourth tick on. The acceleration
 * at its start, with a changing override, may be above the program's limit; its difference is late by two ticks. */
static void evaluate_along(struct course *course, double period_s, const struct stop_trial *trial,
                           const struct stop_limits *limits, struct stop_use *use)
{
    double d[3];
    differences(course, ARC, period_s, d);
    if (course->brake_ticks == 0) {
        course->begun_with = fabs(d[1]);
    } else if (course->brake_ticks > HISTORY) {
        const double begun_with = course->begun_with + 2.0 * period_s * trial->fault.jerk;
        const double most = fmin(fmax(limits->acceleration, begun_with), trial->fault.acceleration);
        grow(&use->path_acceleration, fabs(d[1]) / most);
        grow(&use->path_jerk, fabs(d[2]) / (limits->jerk + NOISE_MM_S3));
    }
}

static int in_brake(const struct course *course)
{
    const enum feed_state state = feed_override_state(&course->feed);
    return (state == FEED_HOLDING || state == FEED_STOPPING) &&
           feed_override_actual_q30(&course->feed) == 0;
}

static int at_rest(const struct course *course)
{
    const enum feed_state state = feed_override_state(&course->feed);
    return state == FEED_HELD || state == FEED_STOPPED || state == FEED_ENDED;
}

static int step(struct course *course, struct stop_trial *trial)
{
    struct interpolator_point point;
    const double period_s = 1e-6 * course->interp.program->header.period_us;
    const int error = feed_override_next(&course->feed, &course->interp, &point);
    if (error != 0) {
        return error;
    }
    memmove(course->points[1], course->points[0], HISTORY * sizeof course->points[0]);
    for (uint32_t axis = 0; axis < course->interp.axis_count; axis++) {
        course->points[0][axis] = ldexp((double)point.position_q40[axis], -40);
    }
    course->points[0][ARC] = ldexp((double)point.arc_length_q40_mm, -40);
    course->count++;
    course->brake_ticks = in_brake(course) || (course->brake_ticks > 0 && at_rest(course))
                              ? course->brake_ticks + 1u
                              : 0u;
    if (course->count > HISTORY) {
        evaluate_axes(course, period_s, course->machine ? &trial->fault : &trial->hold,
                      course->machine ? &trial->of_fault : &trial->of_hold);
        evaluate_along(course, period_s, trial, course->machine ? &trial->fault : &trial->hold,
                       course->machine ? &trial->of_fault : &trial->of_hold);
    }
    return 0;
}

/* --- A trial --- */

static int prelude(struct course *course, struct stop_trial *trial, uint64_t *random)
{
    for (uint32_t left = below(random, MOST_COMMANDS + 1u); left > 0; left--) {
        switch (below(random, 4u)) {
        case 0:
            feed_override_hold(&course->feed);
            break;
        case 1:
            feed_override_resume(&course->feed);
            break;
        default:
            feed_override_set(&course->feed, below(random, 201u));
            break;
        }
        for (uint32_t ticks = below(random, MOST_BETWEEN + 1u); ticks > 0; ticks--) {
            const int error = step(course, trial);
            if (error != 0) {
                return error;
            }
        }
    }
    return 0;
}

/* Time to standstill in ticks; ticks of waiting at an override below 1 are weighted by the override. Below 0: an error,
 * or no standstill. */
static double to_standstill(struct course *course, struct stop_trial *trial)
{
    double ticks = 0.0;
    for (uint32_t i = 0; i < MOST_TICKS; i++) {
        const double rate = ldexp((double)feed_override_actual_q30(&course->feed), -30);
        if (step(course, trial) != 0) {
            return -1.0;
        }
        const int plan = !in_brake(course) && course->brake_ticks == 0 && rate > 0.0;
        ticks += plan ? fmin(rate, 1.0) : 1.0;
        trial->late += feed_override_late(&course->feed) ? 1u : 0u;
        if (at_rest(course)) {
            break;
        }
    }
    for (uint32_t i = 0; i < HISTORY; i++) {
        if (step(course, trial) != 0) {
            return -1.0;
        }
    }
    return at_rest(course) ? ticks : -1.0;
}

static void one(const struct course *from, struct stop_trial *trial, uint64_t seed)
{
    struct course course = *from;
    uint64_t random = seed;
    if (prelude(&course, trial, &random) != 0) {
        trial->failures++;
        return;
    }
    const uint32_t order = below(&random, 3u);
    const enum program_stop_kind kind = order == 2 ? PROGRAM_STOP_FAULT : PROGRAM_STOP_HOLD;
    const int runs = feed_override_state(&course.feed) == FEED_RUNNING &&
                     feed_override_actual_q30(&course.feed) != 0;
    const double bound_s = 1e-6 * feed_override_bound_us(&course.feed, kind);
    if (order == 0) {
        feed_override_hold(&course.feed);
    } else if (order == 1) {
        feed_override_stop(&course.feed);
    } else {
        feed_override_fault_stop(&course.feed);
        course.machine = 1;
    }
    const double ticks = to_standstill(&course, trial);
    if (ticks < 0.0) {
        trial->failures++;
    } else if (runs) {
        const double time_s = ticks * 1e-6 * course.interp.program->header.period_us;
        trial->measured[kind]++;
        grow(&trial->longest_s[kind], time_s);
        grow(&trial->of_bound[kind], time_s / bound_s);
    }
}

static double greatest(const struct stop_trial *trial)
{
    const struct stop_use *uses[] = {&trial->of_hold, &trial->of_fault};
    double most = 0.0;
    for (int i = 0; i < 2; i++) {
        grow(&most, fmax(uses[i]->velocity, uses[i]->acceleration));
        grow(&most, fmax(uses[i]->jerk, fmax(uses[i]->path_acceleration, uses[i]->path_jerk)));
    }
    return most;
}

static void clear(struct stop_trial *trial)
{
    const struct stop_use none = {0};
    const struct stop_case nothing = {0, 0};
    trial->of_hold = trial->of_fault = none;
    for (int kind = 0; kind < 2; kind++) {
        trial->of_bound[kind] = trial->longest_s[kind] = 0.0;
        trial->measured[kind] = 0;
    }
    trial->late = trial->failures = 0;
    trial->most = trial->longest = trial->failed = nothing;
}

/* Executes a trial and stores it if it has a greatest value. */
static void remembered(const struct course *from, struct stop_trial *trial, uint64_t seed,
                       uint32_t tick)
{
    const struct stop_case this = {seed, tick};
    const double most = greatest(trial);
    const double longest = fmax(trial->of_bound[0], trial->of_bound[1]);
    const uint32_t failures = trial->failures;
    one(from, trial, seed);
    trial->most = greatest(trial) > most ? this : trial->most;
    trial->longest = fmax(trial->of_bound[0], trial->of_bound[1]) > longest ? this : trial->longest;
    trial->failed = trial->failures > failures ? this : trial->failed;
}

static int begin(struct course *course, const struct program *p, struct stop_trial *trial)
{
    memset(course, 0, sizeof *course);
    clear(trial);
    const int error = interpolator_begin(&course->interp, p);
    if (error == 0) {
        feed_override_begin(&course->feed, p, p->header.period_us, 0);
    }
    return error;
}

int stop_trial_run(const struct program *p, struct stop_trial *trial)
{
    struct course course;
    uint32_t done = 0;
    const uint32_t ticks = program_ticks(p);
    int error = begin(&course, p, trial);
    for (uint32_t tick = 0; tick < ticks && error == 0; tick++) {
        const uint32_t due = (uint32_t)((uint64_t)trial->trials * (tick + 1u) / ticks);
        for (; done < due; done++) {
            remembered(&course, trial, trial->seed + done, tick);
        }
        error = step(&course, trial);
    }
    return error;
}

int stop_trial_again(const struct program *p, struct stop_trial *trial, uint32_t tick)
{
    struct course course;
    int error = begin(&course, p, trial);
    for (uint32_t i = 0; i < tick && error == 0; i++) {
        error = step(&course, trial);
    }
    if (error == 0) {
        remembered(&course, trial, trial->seed, tick);
    }
    return error;
}
