/* SPDX-License-Identifier: MIT */
/*
 * A brake as the controller makes it (core/path_brake.h), followed along the path of a program beside its limits.
 *
 * A brake has three numbers: jerk of onset, deceleration, jerk of release, as codes of docs/reference/protocol.md 1.4.
 * It is followed tick by tick, but as soon as bounds of the rest of it, or of some ticks, show that the limits are
 * kept, its ticks are not looked at. mm, s. Main loop of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_BRAKE_H
#define HODOGRAPH_OFFLINE_STOP_BRAKE_H

#include <stdint.h>

#include "core/path_brake.h"
#include "core/program.h"
#include "offline/stop_usage.h"

/* What stays while the stops of a program are searched. */
struct stop_setting {
    struct stop_lookup lookup;
    struct stop_inverse inverse;     /* at the rate 1, */
    struct stop_inverse at_any_rate; /* and at others */
    uint32_t rise_is_cut;
    uint32_t quick;
    uint32_t period_us;
    double period_s;
    double length_mm;
    double deceleration; /* greatest */
    int most[3];         /* greatest codes */
};

/* Fills the setting for a program whose path stop_rows() has filled with these limits. */
void stop_setting_open(struct stop_setting *setting, const struct program *p,
                       const struct stop_limits *limits, const struct stop_path *path);

/* The number of a code: jerk, deceleration, jerk for k = 0 ... 2; mm, s. */
double stop_number_of(int k, int code);

/* The numbers of three codes; 0: the controller takes no such numbers. */
int stop_numbers_of(const struct stop_setting *setting, const int codes[3],
                    struct path_brake_numbers *numbers);

/* Begins the brake that the controller would make, at arc length 0; 0 where none fits. */
int stop_brake_begin(struct path_brake *brake, const struct stop_state *from,
                     const struct path_brake_numbers *numbers, double period_s);

/* How long it takes: the continuous curve, and what whole ticks take more on the mean. */
double stop_brake_time(const struct stop_state *from, const struct path_brake_numbers *numbers,
                       double period_s);

/* Whether the controller would find room for the brake before the end of the program. */
int stop_fits_before_end(const struct stop_setting *setting, const struct stop_state *at,
                         const struct path_brake_numbers *numbers);

/* Whether the state has so little speed left, for its deceleration, that no brake need fit: the plan may go on. */
int stop_may_wait(const struct stop_setting *setting, const struct stop_state *at,
                  const struct path_brake_numbers *numbers);

/* Bounds of brakes from states with at most this speed and rise of it, and no more deceleration than `fall`: all of
 * `extent` but its path. Returns the arc length that they do not pass. */
double stop_brake_extent(const struct stop_setting *setting,
                         const struct path_brake_numbers *numbers, const struct stop_state *most,
                         double fall, struct stop_extent *extent);

/* 1 while a brake that has begun at arc length from_mm, behind `row`, keeps the limits all the way; looked at each
 * step_s. */
int stop_brake_keeps(const struct stop_setting *setting, const struct stop_inverse *inverse,
                     const struct path_brake *brake, double from_mm, uint32_t row, double step_s);

#endif
