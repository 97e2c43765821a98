/* SPDX-License-Identifier: MIT */
/*
 * Programs for the override's property test: random feed over a straight line, or a golden image, with override bounds
 * and a stop table made in C from chosen limits by docs/theory/feed.md section 7. Used by test_override.c and chunked.
 * Reads golden images.
 */
#ifndef HODOGRAPH_TESTS_OVERRIDE_PROGRAM_H
#define HODOGRAPH_TESTS_OVERRIDE_PROGRAM_H

#include "core/interpolator.h"
#include "core/program.h"

#define OVERRIDE_PIECES 256

struct override_limits {
    double feed, acceleration, jerk;
};

/* A piece as doubles: coefficients of t in s, and its peaks. */
struct override_piece {
    double start_s, end_s;
    double c[8];
    double feed, acceleration, jerk; /* greatest magnitudes, rounded up a little */
    double rates
        [PROGRAM_LEVELS]; /* bounds as stored: rates of the levels, the last one is the factor, */
    double slopes[PROGRAM_LEVELS]; /* and derivatives of the rate */
    double seconds[PROGRAM_LEVELS];
};

struct override_program {
    struct program program;
    uint8_t *image;
    struct override_limits peak, limit;
    struct override_piece pieces[OVERRIDE_PIECES];
};

/* Random feed over a line; period_us sets the shortest pieces. Free with override_program_close. */
void override_program_random(struct override_program *p, uint32_t period_us, uint64_t *random);
void override_program_golden(struct override_program *p, const char *name);
/* An image on the heap that opens; the program takes it. */
void override_program_image(struct override_program *p, uint8_t *image, uint32_t size);
void override_program_close(struct override_program *p);

/* Limits somewhat above the peaks of the program, and the pieces' bounds from them. */
void override_program_limits(struct override_program *p, uint64_t *random);

/* The override bounds that these limits leave one piece, written into its bytes; and the codes of its stops. */
void override_program_bound(const struct override_limits *limit, uint8_t *piece_bytes);
void override_program_codes(const struct override_limits *limit, uint8_t codes[6]);

/* F', F'', F''' of piece i at a program time in s. */
void override_program_feed(const struct override_program *p, uint32_t i, double time_s,
                           double derivative[4]);

/* Arc lengths of the last four setpoints in mm, and how many have come. All zero: none. */
struct override_trace {
    double arc_mm[4];
    uint32_t known;
};

struct override_differences {
    double jerk, acceleration; /* magnitudes, mm/s^3 and mm/s^2 */
    double back_mm; /* how far the last setpoint is before the one before it; below 0: it is not */
};

/* Adds the next setpoint; 1 when there are four, for the differences over a period of h seconds; else 0. */
int override_trace_add(struct override_trace *trace, int64_t arc_q40_mm, double h,
                       struct override_differences *out);

/* Distance in 2^-40 mm of a point from the exact curve at its arc length, over all axes. `exact` has the same program
 * and stands at or before that place. */
double override_distance_q40(struct interpolator *exact, const struct interpolator_point *point);

/* Uniform in [low, high). */
double override_random(uint64_t *random, double low, double high);

#endif
