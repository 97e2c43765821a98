/* SPDX-License-Identifier: MIT */
/*
 * stop_check: checks the stop table of a program (docs/reference/protocol.md 1.4): does each stop time bound in it
 * cover the longest stop? The bounds are computed anew from the feed pieces, the override bounds and the stop
 * parameters (docs/theory/feed.md section 7, "Stops"). A part of program_check; core/brake_check uses it too, and the
 * host tools compute the table with it.
 *
 * The check goes from the last piece to the first, because a stop that cannot end in one piece continues in the next.
 * Integer arithmetic; every value is rounded so that a bound is never too short. About 10 000 instructions for each
 * piece and kind of stop. Pure, main loop.
 */
#ifndef HODOGRAPH_CORE_STOP_CHECK_H
#define HODOGRAPH_CORE_STOP_CHECK_H

#include <stdint.h>

#include "core/program.h"
#include "core/program_rules.h"

/* Ticks that a stop takes beyond its continuous curve: until the command takes effect, and because it brakes in whole
 * ticks (tests/unit/test_path_brake.c). */
#define STOP_TICKS 9u
/* The stop parameters that apply are those of a piece that begins within this time: three ticks at 200 %, in periods of
 * program time. */
#define STOP_WINDOW_TICKS 6u
/* pieces that begin in it, at most (docs/reference/protocol.md 1.3: no two last less than two periods) */
#define STOP_WINDOW 8

/* From the command to standstill; saturates at UINT32_MAX. */
struct stop_bound {
    uint32_t time_us;
    uint32_t distance_um;
};

/* Contents private. */
struct stop_walk {
    const struct program *program;
    enum program_stop_kind kind;
    uint64_t window_q32_s;
    struct stop_bound own[STOP_WINDOW];   /* of the pieces after it, the nearest first, */
    uint64_t duration_q32_s[STOP_WINDOW]; /* and their durations */
    struct stop_bound next;               /* bound of the next piece */
    uint32_t count;
};

/* Motion of a piece at override 1. */
struct stop_extent {
    uint64_t speed_um;  /* greatest, um/s, */
    uint64_t rising_um; /* and acceleration, um/s^2 */
    /* the most eighths of the piece in a row in which no path stop may fit, */
    uint32_t waits;
    uint32_t last; /* and those at its end */
};

void stop_piece_extent(const struct program *p, uint32_t piece, uint64_t jerk_up_q18,
                       struct stop_extent *out);

/* Where a path stop begins: the speed at the greatest override, the acceleration at a constant override, and slope_um,
 * the acceleration that a changing override adds. Lengths in um, times in s, cut_us in us. An override that still rises
 * is below the greatest one by what it gains until its rate is 0, which takes at least cut_us. So slope_um raises the
 * speed only if the jerk of onset needs longer than cut_us to remove it, and only for the difference of the two
 * times. */
struct stop_start {
    uint64_t speed_um;
    uint64_t rising_um;
    uint64_t slope_um;
    uint64_t cut_us;
};

/* The greatest of these in a level of the override bounds (docs/reference/protocol.md 1.3). */
void stop_level_start(const struct stop_extent *extent, const struct program_override *bounds,
                      uint32_t level, struct stop_start *out);

/* The greatest override rate in a level, 2^-16 /s. */
uint64_t stop_level_slope_q16(const struct program_override *bounds, uint32_t level);

/* The path stop of the table alone: its continuous curve. */
struct stop_bound stop_curve(const struct stop_start *from, const struct program_stop *stop);

/* Begins after the last piece of a program whose pieces and segments have passed their checks. */
void stop_walk_begin(struct stop_walk *walk, const struct program *p, enum program_stop_kind kind);

/* The bound of the piece before: the first call gives that of the last piece, and so on. */
struct stop_bound stop_walk_back(struct stop_walk *walk, uint32_t piece);

/* Checks the table against limits. Returns 0 or the code of a broken rule; *index is its piece. */
int stop_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index);

#endif
