/* SPDX-License-Identifier: MIT */
/*
 * Programs for the override's property test: random feed over a straight line, or a golden image, with override bounds
 * and a stop table made in C from chosen limits, as docs/theory/numerics.md section 7 says.
 */
#ifndef HODOGRAPH_TESTS_OVERRIDE_PROGRAM_H
#define HODOGRAPH_TESTS_OVERRIDE_PROGRAM_H

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

/* Uniform in [low, high). */
double override_random(uint64_t *random, double low, double high);

#endif
