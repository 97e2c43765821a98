/* SPDX-License-Identifier: MIT */
/* Implements numerics/override_headroom.h (see there): the part of the axis limits that a changing feed override may
 * use. Called by host_tools/hodograph/native. Writes the caller's arrays only; any thread. */
#include "numerics/override_headroom.h"

#include <math.h>
#include <stddef.h>

#define TINY 1e-12

static double lesser(double a, double b)
{
    return b < a ? b : a;
}

static double greater(double a, double b)
{
    return b > a ? b : a;
}

/* A cell of an axis: its first sample, and the override there. */
struct cell {
    size_t axis, begin;
    double f, square, cube;
};

static struct cell cell_of(const struct override_samples *samples, const struct override_powers *at,
                           size_t axis, size_t number)
{
    const size_t piece = (size_t)samples->piece[number];
    const struct cell out = {
        .axis = axis,
        .begin = (axis * samples->cells + number) * samples->samples,
        .f = at->first[piece],
        .square = at->second[piece],
        .cube = at->third[piece],
    };
    return out;
}

static double limit_at(const struct override_samples *samples, const double *most,
                       const struct cell *cell, size_t k)
{
    return most[samples->by_sample != 0u ? cell->begin + k : cell->axis];
}

/* f v + f^2 T a at a sample */
static double pull_at(const struct override_samples *samples, const struct cell *cell, size_t k)
{
    const size_t i = cell->begin + k;
    const double pull = samples->time_constant[cell->axis] * samples->signed_acceleration[i];
    return cell->f * samples->signed_velocity[i] + cell->square * pull;
}

/* The greatest |lambda v + lambda^2 T a| for 0 <= lambda <= f at a sample: that at f, with its possible rise between
 * samples `bend`, or the one between if v and a have opposite signs. */
static double greatest_pull(const struct override_samples *samples, const struct cell *cell,
                            size_t k, double pull_at_f, double bend)
{
    const size_t i = cell->begin + k;
    const double v = samples->signed_velocity[i];
    const double pull = samples->time_constant[cell->axis] * samples->signed_acceleration[i];
    const double raised = fabs(pull_at_f) + bend;
    const int apart = v * pull < 0.0 && fabs(v) < 2.0 * cell->f * fabs(pull);
    const double square = samples->velocity[i] * samples->velocity[i];
    return greater(raised, apart ? square / (4.0 * greater(fabs(pull), TINY)) : 0.0);
}

/* The override rate that the volts allow in a cell. */
static double rate_by_volts(const struct override_samples *samples, const struct cell *cell)
{
    const size_t last = samples->samples - 1u;
    double least = HUGE_VAL;
    double pull[3] = {0.0, pull_at(samples, cell, 0), pull_at(samples, cell, 1)};
    double bend = 0.0;
    for (size_t k = 0; k <= last; k++) {
        /* pull[1] is at sample k; the ends take the bend of the samples next to them */
        const double next = k + 2u <= last ? pull_at(samples, cell, k + 2u) : 0.0;
        if (k == 0) {
            bend = fabs((next - pull[2]) - (pull[2] - pull[1])) / 8.0;
        } else if (k < last) {
            bend = fabs((pull[2] - pull[1]) - (pull[1] - pull[0])) / 8.0;
        }
        const double most = greatest_pull(samples, cell, k, pull[1], bend);
        const double slope =
            samples->time_constant[cell->axis] * samples->velocity[cell->begin + k];
        least = lesser(least, (samples->reach[cell->axis] - most) / slope);
        pull[0] = pull[1];
        pull[1] = pull[2];
        pull[2] = next;
    }
    return least;
}

void override_rates(const struct override_samples *samples, const struct override_powers *at,
                    double *rest, double *jerk)
{
    for (size_t axis = 0; axis < samples->axes; axis++) {
        for (size_t number = 0; number < samples->cells; number++) {
            const struct cell cell = cell_of(samples, at, axis, number);
            double least = HUGE_VAL;
            double least_by_jerk = HUGE_VAL;
            for (size_t k = 0; k < samples->samples; k++) {
                const size_t i = cell.begin + k;
                const double a = samples->acceleration[i];
                const double most_a = limit_at(samples, samples->most_acceleration, &cell, k);
                const double most_j = limit_at(samples, samples->most_jerk, &cell, k);
                least = lesser(least, (most_a - cell.square * a) / samples->velocity[i]);
                least_by_jerk = lesser(least_by_jerk, (most_j - cell.cube * samples->jerk[i]) /
                                                          (3.0 * cell.f * a));
            }
            if (samples->reach != NULL) {
                least = lesser(least, rate_by_volts(samples, &cell));
            }
            const int64_t piece = samples->piece[number];
            rest[piece] = lesser(rest[piece], least);
            jerk[piece] = lesser(jerk[piece], least_by_jerk);
        }
    }
}

void override_seconds(const struct override_samples *samples, const struct override_powers *at,
                      const double *rate, double *second)
{
    for (size_t axis = 0; axis < samples->axes; axis++) {
        for (size_t number = 0; number < samples->cells; number++) {
            const struct cell cell = cell_of(samples, at, axis, number);
            const int64_t piece = samples->piece[number];
            double least = HUGE_VAL;
            for (size_t k = 0; k < samples->samples; k++) {
                const size_t i = cell.begin + k;
                const double v = samples->velocity[i];
                const double most = limit_at(samples, samples->most_jerk, &cell, k);
                const double still = (most - cell.cube * samples->jerk[i]) / v;
                const double falls = 3.0 * cell.f * samples->acceleration[i] / v;
                least = lesser(least, still - rate[piece] * falls);
            }
            second[piece] = lesser(second[piece], least);
        }
    }
}
