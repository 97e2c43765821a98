/* SPDX-License-Identifier: MIT */
/*
 * stop_verdict: whether path stops with given codes keep the limits from all instants of a feed piece, and how long
 * they take. Used by offline/stop_search.
 *
 * There are two tests. The first one follows path stops at override 1 from few instants (stop_all_keep). The strict
 * one, which decides, follows them from instants close to each other, at all overrides, and from states inside another
 * path stop (stop_strictly). A test begins at the instant that broke a limit last, because most codes that break one do
 * so there. mm, s. Any thread of a host; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_VERDICT_H
#define HODOGRAPH_OFFLINE_STOP_VERDICT_H

#include "core/path_brake.h"
#include "offline/stop_brake.h"
#include "offline/stop_piece.h"

/* codes below the greatest: a path stop with less than an eighth of a limit is not used */
#define STOP_FEWER   24
#define STOP_NEVER_S 1e6 /* time of a stop that is not possible */

/* Times to standstill from the instants of a piece, from the last to the first: of a path stop, or of waiting for one.
 * */
struct stop_times {
    double mean_s, worst_s, first_s;
    double longest_s;               /* path stop at any override */
    double cost_s;                  /* the mean, and a share of the longest */
    int brakes[STOP_MOST_INSTANTS]; /* 0: the nominal motion continues */
};

/* Fills the times; after_s: the time to standstill from the end of the piece. Returns 0 if the controller would not
 * begin a path stop although the end of the program is far. */
int stop_times_of(const struct stop_setting *setting, const struct stop_piece *piece,
                  const struct path_brake_numbers *numbers, double after_s,
                  struct stop_times *times);

/* Whether codes are near enough to the greatest ones of the piece. */
int stop_within(const struct stop_piece *piece, const int codes[3]);

/* The first test: whether these path stops keep the limits at override 1. */
int stop_all_keep(const struct stop_setting *setting, struct stop_piece *piece,
                  const struct stop_times *times, const struct path_brake_numbers *numbers);

/* Whether a path stop keeps the limits from the state in which other codes broke one last. */
int stop_suspect_keeps(const struct stop_setting *setting, const struct stop_piece *piece,
                       const struct path_brake_numbers *numbers);

/* Whether path stops that replace another one, piece->before, keep the limits: a part of the strict test. */
int stop_out_of_brakes_keeps(const struct stop_setting *setting, struct stop_piece *piece,
                             const int codes[3]);

/* The strict test: at all overrides, from more instants, and in place of another path stop. Fills piece->close. */
int stop_strictly(const struct stop_setting *setting, struct stop_piece *piece, const int codes[3]);

#endif
