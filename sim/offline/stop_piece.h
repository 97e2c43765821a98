/* SPDX-License-Identifier: MIT */
/*
 * stop_piece: a feed piece as the instants at which a stop may begin, and the states in which the motion may be there:
 * at override 1, and at other overrides, constant or changing as fast as the piece allows. Used by offline/stop_verdict
 * and offline/stop_search. mm, s. Any thread of a host; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_PIECE_H
#define HODOGRAPH_OFFLINE_STOP_PIECE_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_brake.h"

#define STOP_MOST_INSTANTS 1025   /* of a piece */
#define STOP_INSTANT_S     0.004  /* the most between two of them, if these are enough, */
#define STOP_CLOSE_S       0.0005 /* and in the strict test of the result */
#define STOP_END_MARGIN    1e-6   /* share of a piece: jerks jump at its ends */
#define STOP_SHARES 11u /* feed overrides, and as many shares of the piece's greatest override */

/* An instant of a piece at a feed override: `rate` is a number of stop_override_at(), `slope` the sign of the
 * override's change. */
struct stop_overridden {
    uint32_t instant;
    uint32_t rate;
    int slope;
};

/* One piece with its sampled instants. */
struct stop_piece {
    struct stop_state at[STOP_MOST_INSTANTS];
    double at_s[STOP_MOST_INSTANTS];  /* since the start of the piece */
    uint32_t row[STOP_MOST_INSTANTS]; /* of the path, before it */
    uint32_t count;
    double seconds;
    int most[3];               /* greatest codes */
    int before[3];             /* codes of a path stop that this one may replace; 0: none */
    double left_s;             /* duration of the program after the piece */
    struct stop_state fastest; /* at all overrides: greatest speed and acceleration */
    struct stop_state extreme; /* at override 1: greatest speed and acceleration of either sign */
    double factor;             /* greatest override; */
    double level[PROGRAM_LEVELS], slope[PROGRAM_LEVELS],
        second[PROGRAM_LEVELS];              /* bounds up to these overrides */
    uint32_t suspect;                        /* the instant at which a limit was broken last, */
    struct stop_overridden suspect_override; /* and the same at other feed overrides, */
    struct stop_overridden suspect_before;   /* and where a stop that replaces another broke one */
    int first_fails;                         /* 1: the first test (stop_verdict.h) failed last */
    struct stop_piece *close;                /* the same piece with more instants */
};

/* Powers of u = 0 ... 1 over the piece, mm; returns its duration. */
double stop_piece_powers(const struct program_piece *from, double c[8]);

/* A derivative of such powers by u. */
double stop_piece_value(const double c[8], double u, int order);

/* Fills piece i of a program, with instants step_s apart or less; left_s: duration of the program after it. */
void stop_piece_fill(const struct stop_setting *setting, const struct program *p, uint32_t i,
                     double left_s, double step_s, struct stop_piece *piece);

/* Half the time from the previous instant to the next one. */
double stop_weight_s(const struct stop_piece *piece, uint32_t i);

/* Greatest override rate. */
double stop_greatest_slope(const struct stop_piece *piece);

/* The state at an instant and override; a rising override adds at most `little` to the acceleration. Returns 0 if the
 * motion cannot be in such a state. */
int stop_overridden_state(const struct stop_piece *piece, const struct stop_overridden *which,
                          double little, struct stop_state *from);

/* Bounds of these states for all instants at override number r: speed, acceleration, and deceleration. */
void stop_overridden_most(const struct stop_piece *piece, uint32_t r, double little, double *speed,
                          double *rise, double *fall);

#endif
