/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_brake.h (see there): whether a path stop keeps given limits. Used by
 * offline/stop_search, offline/stop_piece and offline/stop_verdict. Changes its arguments only; any thread of a host.
 */
#include "offline/stop_brake.h"

#include <math.h>

#define GREATEST_CODE 255  /* codes of jerk and deceleration are bytes */
#define LEAST_MM_S    1e-4 /* slower is standstill */
#define TICKS_MORE    3.0  /* of a path stop than of its continuous curve */
/* ticks of a path stop between two tests by bounds: whether these ticks, or all remaining ones, keep the limits */
#define SURE_EACH   16
#define SPARE_TIME  1.25 /* bounds of a whole path stop cover this multiple of stop_brake_time, */
#define SPARE_TICKS 10.0 /* and this number of ticks more */
/* share by which a feed, or an axis' velocity, may exceed its limit at overrides other than 1: the sampled states there
 * include some that the look-ahead of the controller excludes */
#define FASTER 0.03

double stop_number_of(int k, int code)
{
    const double mantissa = floor(65536.0 * pow(2.0, (code & 7) / 8.0));
    return ldexp(mantissa, (code >> 3) - (k == 1 ? 24 : 18));
}

int stop_numbers_of(const struct stop_setting *setting, const int codes[3],
                    struct path_brake_numbers *numbers)
{
    const struct program_stop stop = {
        .jerk_down = (uint8_t)codes[0],
        .deceleration = (uint8_t)codes[1],
        .jerk_up = (uint8_t)codes[2],
    };
    return path_brake_numbers_of(numbers, &stop, setting->period_us);
}

int stop_brake_begin(struct path_brake *brake, const struct stop_state *from,
                     const struct path_brake_numbers *numbers, double period_s)
{
    const struct path_state state = {
        .speed_q56 = (int64_t)(from->v * period_s * 0x1p56),
        .acceleration_q56 = (int64_t)(from->a * period_s * period_s * 0x1p56),
    };
    return path_brake_begin(brake, &state, numbers);
}

double stop_brake_time(const struct stop_state *from, const struct path_brake_numbers *numbers,
                       double period_s)
{
    double tick3 = ldexp(1.0, -56) / (period_s * period_s * period_s);
    double down = (double)numbers->jerk_down_q56 * tick3;
    double up = (double)numbers->jerk_up_q56 * tick3;
    double most = (double)numbers->deceleration_q56 * tick3 * period_s;
    double square = from->a * from->a / down;
    double depth = stop_lesser(sqrt((2.0 * from->v + square) / (1.0 / down + 1.0 / up)), most);
    double change = from->a + depth > 0.0 ? down : -down;
    double speed = from->v + (from->a * from->a - depth * depth) / (2.0 * change);
    double even_s = stop_greater(speed / depth - depth / (2.0 * up), 0.0);
    return fabs(from->a + depth) / down + even_s + depth / up + TICKS_MORE * period_s;
}

int stop_fits_before_end(const struct stop_setting *setting, const struct stop_state *at,
                         const struct path_brake_numbers *numbers)
{
    const struct path_state state = {
        .speed_q56 = (int64_t)(at->v * setting->period_s * 0x1p56),
        .acceleration_q56 = (int64_t)(at->a * setting->period_s * setting->period_s * 0x1p56),
    };
    return path_brake_fits(&state, numbers, (int64_t)ldexp(setting->length_mm - at->s, 40));
}

int stop_may_wait(const struct stop_setting *setting, const struct stop_state *at,
                  const struct path_brake_numbers *numbers)
{
    double period_s = setting->period_s;
    double up = ldexp((double)numbers->jerk_up_q56, -56) / (period_s * period_s * period_s);
    return at->v < LEAST_MM_S ||
           (at->a < 0.0 && at->v < at->a * at->a / (2.0 * up) - 3.0 * at->a * period_s);
}

static struct stop_state state_of(const struct path_brake *brake, double from_mm, double period_s)
{
    struct stop_state out = {
        .s = from_mm + (double)brake->at.arc_length_q40_mm * 0x1p-40,
        .v = (double)brake->at.speed_q56 * 0x1p-56 / period_s,
        .a = (double)brake->at.acceleration_q56 * 0x1p-56 / (period_s * period_s),
    };
    return out;
}

static struct stop_state moved(const struct stop_state *from, double j, double t)
{
    struct stop_state to = {
        .s = from->s + t * (from->v + t * (from->a / 2.0 + t * j / 6.0)),
        .v = from->v + t * (from->a + t * j / 2.0),
        .a = from->a + t * j,
    };
    return to;
}

/* 1 if one tick keeps the limits, sampled at `parts` places. */
static int tick_keeps(const struct stop_setting *setting, const struct stop_inverse *inverse,
                      const struct stop_state *from, const struct stop_state *to, uint32_t *row,
                      int parts)
{
    double j = (to->a - from->a) / setting->period_s;
    for (int k = 0; k < parts; k++) {
        struct stop_state at = moved(from, j, setting->period_s * k / parts);
        stop_pass_rows(&setting->lookup, at.s, row);
        if (stop_usage(&setting->lookup, inverse, &setting->lookup.rows[*row], &at, j) > 1.0) {
            return 0;
        }
    }
    return 1;
}

double stop_brake_extent(const struct stop_setting *setting,
                         const struct path_brake_numbers *numbers, const struct stop_state *most,
                         double fall, struct stop_extent *extent)
{
    const double period_s = setting->period_s;
    const double tick2 = ldexp(1.0, -56) / (period_s * period_s);
    const double down = (double)numbers->jerk_down_q56 * tick2 / period_s;
    const double up = (double)numbers->jerk_up_q56 * tick2 / period_s;
    const double most_s = SPARE_TIME * stop_brake_time(most, numbers, period_s) + fall / down +
                          SPARE_TICKS * period_s;
    extent->speed = most->v + most->a * (most->a / (2.0 * down) + SPARE_TICKS * period_s);
    extent->acceleration =
        stop_greater(stop_greater(most->a, fall), (double)numbers->deceleration_q56 * tick2);
    extent->jerk = stop_greater(down, up);
    return most->s + extent->speed * most_s;
}

/* 1: bounds show that the remaining path stop keeps the limits; 0: they do not decide. Most path stops at low overrides
 * are far from the limits, and following each of them would take nearly all of the time of a search. */
static int surely_keeps(const struct stop_setting *setting, const struct stop_inverse *inverse,
                        const struct path_brake *brake, double from_mm, uint32_t row)
{
    struct stop_state most = state_of(brake, from_mm, setting->period_s);
    const double fall = stop_greater(-most.a, 0.0);
    struct stop_extent extent;
    most.a = stop_greater(most.a, 0.0);
    const double to_mm = stop_brake_extent(setting, &brake->numbers, &most, fall, &extent);
    return stop_keeps_up_to(&setting->lookup, inverse, &extent, row, to_mm);
}

/* 1: bounds show that some ticks of a path stop, at[0 ... count], keep the limits; 0: they do not decide. */
static int ticks_surely_keep(const struct stop_setting *setting, const struct stop_inverse *inverse,
                             const struct stop_state *at, int count, uint32_t row)
{
    const double period_s = setting->period_s;
    struct stop_extent extent = {.speed = 0.0, .acceleration = fabs(at[0].a), .jerk = 0.0};
    for (int k = 0; k < count; k++) {
        const double rise = stop_greater(stop_greater(at[k].a, at[k + 1].a), 0.0);
        extent.speed = stop_greater(extent.speed, at[k].v + rise * period_s);
        extent.acceleration = stop_greater(extent.acceleration, fabs(at[k + 1].a));
        extent.jerk = stop_greater(extent.jerk, fabs(at[k + 1].a - at[k].a) / period_s);
    }
    return stop_keeps_up_to(&setting->lookup, inverse, &extent, row, at[count].s);
}

int stop_brake_keeps(const struct stop_setting *setting, const struct stop_inverse *inverse,
                     const struct path_brake *brake, double from_mm, uint32_t row, double step_s)
{
    struct path_brake tick = *brake;
    struct stop_state at[SURE_EACH + 1];
    const int parts = (int)ceil(setting->period_s / step_s);
    const int each = (int)stop_greater(step_s / setting->period_s, 1.0);
    int done = 0;
    at[0] = state_of(&tick, from_mm, setting->period_s);
    while (!path_brake_ended(&tick)) {
        if (surely_keeps(setting, inverse, &tick, from_mm, row)) {
            return 1;
        }
        int count = 0;
        while (count < SURE_EACH && !path_brake_ended(&tick)) {
            if (done + count == 0) {
                path_brake_first(&tick);
            } else {
                path_brake_step(&tick);
            }
            count++;
            at[count] = state_of(&tick, from_mm, setting->period_s);
        }
        const int surely = ticks_surely_keep(setting, inverse, at, count, row);
        for (int k = 0; k < count && !surely; k++) {
            if ((done + k) % each == 0 &&
                !tick_keeps(setting, inverse, &at[k], &at[k + 1], &row, parts)) {
                return 0;
            }
        }
        done += count;
        at[0] = at[count];
        stop_pass_rows(&setting->lookup, at[0].s, &row);
    }
    return 1;
}

void stop_setting_open(struct stop_setting *setting, const struct program *p,
                       const struct stop_limits *limits, const struct stop_path *path,
                       struct stop_last *last)
{
    stop_lookup_open(&setting->lookup, p, path, last);
    setting->period_us = p->header.period_us;
    setting->period_s = 1e-6 * p->header.period_us;
    setting->length_mm = ldexp((double)p->header.length_q40_mm, -40);
    setting->rise_is_cut = limits->rise_is_cut;
    setting->quick = limits->quick;
    setting->deceleration = limits->acceleration;
    stop_invert(&setting->inverse, limits, setting->lookup.axis_count);
    setting->at_any_rate = setting->inverse;
    setting->at_any_rate.feed /= 1.0 + FASTER;
    for (uint32_t k = 0; k < setting->lookup.axis_count; k++) {
        setting->at_any_rate.velocity[k] /= 1.0 + FASTER;
        setting->at_any_rate.reach[k] *= limits->reach_at_rate_1 != 0u ? 0.0 : 1.0;
    }
    for (int k = 0; k < 3; k++) {
        const double *axis = k == 1 ? limits->axis_acceleration : limits->axis_jerk;
        double all = hypot(axis[0], axis[1]);
        all = setting->lookup.axis_count > PROGRAM_PLANE ? hypot(all, axis[2]) : all;
        double limit = fmin(k == 1 ? limits->acceleration : limits->jerk, all);
        setting->most[k] = 0;
        for (int c = 1; c <= GREATEST_CODE; c++) {
            setting->most[k] = stop_number_of(k, c) <= limit ? c : setting->most[k];
        }
    }
}
