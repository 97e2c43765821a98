/* SPDX-License-Identifier: MIT */
/*
 * Whether the codes of a stop are good for a feed piece: whether brakes with them keep the limits from all of its
 * instants, and how long they take.
 *
 * Two looks. The first one follows brakes at the rate 1 from few instants (stop_all_keep). The strict one, which
 * decides, follows them from instants close to each other, at all feed overrides, and out of the brake of another stop
 * (stop_strictly). A look begins at the instant that broke a limit last: most codes that break one do so there.
 * mm, s. Main loop of a host.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_VERDICT_H
#define HODOGRAPH_OFFLINE_STOP_VERDICT_H

#include "core/path_brake.h"
#include "offline/stop_brake.h"
#include "offline/stop_piece.h"

/* codes below the greatest: a brake with less than an eighth of a limit is none */
#define STOP_FEWER   24
#define STOP_NEVER_S 1e6

/* Times to rest from the instants of a piece, from the last to the first: of a brake, or of waiting for one. */
struct stop_times {
    double mean_s, worst_s, first_s;
    double longest_s;               /* brake at any rate */
    double cost_s;                  /* the mean, and a share of the longest */
    int brakes[STOP_MOST_INSTANTS]; /* 0: the plan goes on */
};

/* Fills the times; after_s: the time to rest from the end of the piece. Returns 0 where the controller would not begin
 * a brake although the program still has far to go. */
int stop_times_of(const struct stop_setting *setting, const struct stop_piece *piece,
                  const struct path_brake_numbers *numbers, double after_s,
                  struct stop_times *times);

/* Whether codes are near enough to the greatest ones of the piece. */
int stop_within(const struct stop_piece *piece, const int codes[3]);

/* The first look: whether these brakes keep the limits at the rate 1. */
int stop_all_keep(const struct stop_setting *setting, struct stop_piece *piece,
                  const struct stop_times *times, const struct path_brake_numbers *numbers);

/* Whether a brake keeps the limits in the state in which other codes broke one last. */
int stop_suspect_keeps(const struct stop_setting *setting, const struct stop_piece *piece,
                       const struct path_brake_numbers *numbers);

/* Whether brakes out of another stop, piece->before, keep the limits: a part of the strict look. */
int stop_out_of_brakes_keeps(const struct stop_setting *setting, struct stop_piece *piece,
                             const int codes[3]);

/* The strict look: at all rates, from more instants, out of the brake of another stop; piece->close is filled. */
int stop_strictly(const struct stop_setting *setting, struct stop_piece *piece, const int codes[3]);

#endif
