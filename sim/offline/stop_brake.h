/* SPDX-License-Identifier: MIT */
/*
 * stop_brake: whether a path stop of the controller (core/path_brake.h) keeps given limits along the path of a program.
 * Used by offline/stop_search, offline/stop_piece and offline/stop_verdict.
 *
 * A path stop has three numbers: jerk of onset, deceleration, jerk of release, as codes of docs/reference/protocol.md
 * 1.4. It is followed tick by tick. If bounds of all its remaining ticks, or of some of them, show that the limits are
 * kept, these ticks are not evaluated one by one. mm, s. Any thread of a host; the functions change their arguments
 * only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_BRAKE_H
#define HODOGRAPH_OFFLINE_STOP_BRAKE_H

#include <stdint.h>

#include "core/path_brake.h"
#include "core/program.h"
#include "offline/stop_usage.h"

/* The inputs of the search for one program, constant during the search. */
struct stop_setting {
    struct stop_lookup lookup;
    struct stop_inverse inverse;     /* limits at override 1, */
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
                       const struct stop_limits *limits, const struct stop_path *path,
                       struct stop_last *last);

/* The number of a code: jerk, deceleration, jerk for k = 0 ... 2; mm, s. */
double stop_number_of(int k, int code);

/* The numbers of three codes; 0: the controller refuses such numbers. */
int stop_numbers_of(const struct stop_setting *setting, const int codes[3],
                    struct path_brake_numbers *numbers);

/* Begins the path stop that the controller would make, at arc length 0; returns 0 if none fits. */
int stop_brake_begin(struct path_brake *brake, const struct stop_state *from,
                     const struct path_brake_numbers *numbers, double period_s);

/* Duration of a path stop: that of the continuous curve, and the mean excess because it brakes in whole ticks. */
double stop_brake_time(const struct stop_state *from, const struct path_brake_numbers *numbers,
                       double period_s);

/* Whether the controller would accept the path stop, because it ends before the program does. */
int stop_fits_before_end(const struct stop_setting *setting, const struct stop_state *at,
                         const struct path_brake_numbers *numbers);

/* Whether the speed is so low for the deceleration of the state that no path stop has to fit: the nominal motion may
 * continue. */
int stop_may_wait(const struct stop_setting *setting, const struct stop_state *at,
                  const struct path_brake_numbers *numbers);

/* Bounds of all path stops from states with at most the speed and acceleration of `most`, and at most the deceleration
 * `fall`: fills `extent` except its path. Returns an upper bound of their braking distance, mm. */
double stop_brake_extent(const struct stop_setting *setting,
                         const struct path_brake_numbers *numbers, const struct stop_state *most,
                         double fall, struct stop_extent *extent);

/* 1: a path stop that has begun at arc length from_mm, at or after `row`, keeps the limits until standstill; sampled
 * each step_s. */
int stop_brake_keeps(const struct stop_setting *setting, const struct stop_inverse *inverse,
                     const struct path_brake *brake, double from_mm, uint32_t row, double step_s);

#endif
