/* SPDX-License-Identifier: MIT */
/*
 * program_clock: which program time each tick has, and which feed piece that time is in. Used by core/override_plan,
 * which decides the override, and core/feed_override. Changes only its struct; no I/O.
 *
 * A tick advances the clock by the period times the feed override of that tick. At override 1, tick k is at min(k
 * period, duration), without drift, in two resolutions: q42 is floor(k period_us 2^42 / 10^6 + 1/2), which a tick uses;
 * q32 likewise, which the object dictionary shows. At another override the time is exact to 2^-62 s in each tick
 * (docs/theory/numerics.md section 12, "Feed override").
 *
 * Integers only, the same on every target. No heap; about 0.1 KiB. What a tick calls is inline here. Tick context, if
 * not stated otherwise.
 */
#ifndef HODOGRAPH_CORE_PROGRAM_CLOCK_H
#define HODOGRAPH_CORE_PROGRAM_CLOCK_H

#include <stddef.h>
#include <stdint.h>

#include "core/coefficients.h"
#include "core/override_ramp.h"
#include "core/program.h"
#include "core/qmath.h"

/* 10^6 = 15625 * 2^6: periods in 2^-42 s are multiples of 1/15625. */
#define PROGRAM_CLOCK_REMAINDER_UNIT 15625u
#define PROGRAM_CLOCK_FINE_BITS      20
/* Piece ends in a tick: docs/reference/protocol.md 1.3. */
#define PROGRAM_CLOCK_MOST_ENDS 2u

/* Read the fields, change them by the functions only. */
struct program_clock {
    const struct program *program;
    uint64_t duration_q42_s;
    uint64_t time_q42_s;   /* of the last tick, rounded down; */
    uint32_t remainder;    /* its remainder in 1/15625 of 2^-42 s, from ticks at override 1, */
    uint32_t fine;         /* and in 2^-62 s, from all other ticks; each below 2^-42 s */
    uint64_t period_q42_s; /* rounded down */
    uint32_t period_remainder;
    uint32_t period_us;
    uint32_t period_log2;  /* of the period in ms */
    uint32_t period_q32_s; /* rounded up, for look-ahead */
    uint64_t sixth_q70_s;  /* a sixth of the period */
    /* program time of a tick whose override does not change; 0: not computed yet */
    uint64_t even_q62_s;
    uint32_t piece; /* of the last tick, */
    /* and its coefficient record; not in use while the clock does not advance */
    const struct coefficients_piece *record;
};

/* Sets the clock to a program time of a checked program with coefficient records; beyond the duration: to the duration.
 * period_us: 1000, 2000, 4000 or 8000. Linear in the number of pieces: main loop. */
void program_clock_begin(struct program_clock *clock, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s);

/* Sets the clock to a time inside this piece, which has this record. Tick context. */
void program_clock_set(struct program_clock *clock, uint64_t time_q42_s, uint32_t piece,
                       const struct coefficients_piece *record);

/* Sets the clock to the start of a program whose first piece has this record. Main loop. */
void program_clock_begin_at_piece(struct program_clock *clock, const struct program *p,
                                  uint32_t period_us, const struct coefficients_piece *first);

/* The same instant in a program that begins `shift` later, inside its piece of this number. The remainder below 2^-42 s
 * stays. `record` is that of the piece; NULL if program_clock_set follows before the next tick. Main loop. */
void program_clock_carry(struct program_clock *clock, const struct program *p, uint64_t shift_q42_s,
                         uint32_t piece, const struct coefficients_piece *record);

/* Program time of a tick in 2^-62 s, in which the override changes from `from` to the slope at its end (2^-56 a tick):
 * six times its mean is 3 override + 2 slope + next slope. */
uint64_t program_clock_step_q62_s(const struct program_clock *clock,
                                  const struct override_state *from, int64_t slope_q56);

/* Program time of the last tick in 2^-42 s, rounded to nearest: for interpolator_at_q42. */
static inline uint64_t program_clock_time_q42(const struct program_clock *clock)
{
    if (clock->fine == 0) {
        return clock->time_q42_s + (2u * clock->remainder > PROGRAM_CLOCK_REMAINDER_UNIT ? 1u : 0u);
    }
    uint64_t remainder = ((uint64_t)clock->remainder << PROGRAM_CLOCK_FINE_BITS) +
                         qmath_product_unsigned(clock->fine, PROGRAM_CLOCK_REMAINDER_UNIT);
    uint64_t half = (uint64_t)PROGRAM_CLOCK_REMAINDER_UNIT << (PROGRAM_CLOCK_FINE_BITS - 1);
    if (remainder <= half) {
        return clock->time_q42_s;
    }
    return clock->time_q42_s + (remainder > 3u * half ? 2u : 1u);
}

/* --- A tick: one of the two that advance, then program_clock_enter. --- */

/* A tick of this program time. */
static inline void program_clock_advance_q62(struct program_clock *clock, uint64_t step_q62_s)
{
    uint64_t sum = clock->fine + step_q62_s;
    clock->time_q42_s += sum >> PROGRAM_CLOCK_FINE_BITS;
    clock->fine = (uint32_t)sum & ((1u << PROGRAM_CLOCK_FINE_BITS) - 1u);
}

/* A tick whose override does not change: exactly a period at override 1, else even_q62_s. */
static inline void program_clock_advance_even(struct program_clock *clock, int64_t override_q57)
{
    if (override_q57 != OVERRIDE_ONE) {
        program_clock_advance_q62(clock, clock->even_q62_s);
        return;
    }
    uint64_t time_q42_s = clock->time_q42_s + clock->period_q42_s;
    uint32_t remainder = clock->remainder + clock->period_remainder;
    if (remainder >= PROGRAM_CLOCK_REMAINDER_UNIT) {
        remainder -= PROGRAM_CLOCK_REMAINDER_UNIT;
        time_q42_s++;
    }
    clock->time_q42_s = time_q42_s;
    clock->remainder = remainder;
}

/* For a time that is neither in the present piece nor at the end of the program: changes to the piece of this time,
 * over at most `most` ends. If they are not enough, or a record is missing, the piece ends before the time, and
 * interpolator_at_piece refuses it. */
static inline void program_clock_find_piece(struct program_clock *clock, uint64_t time_q42_s,
                                            uint32_t most)
{
    const struct coefficients_piece *record = clock->record;
    uint32_t left = most;
    do {
        record = coefficients_piece_next(record);
        left--;
    } while (time_q42_s >= record->end_q42_s && left > 0);
    clock->record = record;
    clock->piece = record->number;
}

/* For a time at or beyond the end of the present piece: changes to the piece of this time, or stays at the duration. */
static inline uint64_t program_clock_pass_end(struct program_clock *clock, uint64_t time_q42_s)
{
    if (time_q42_s >= clock->duration_q42_s) {
        clock->time_q42_s = clock->duration_q42_s;
        clock->remainder = 0;
        clock->fine = 0;
        return clock->duration_q42_s;
    }
    program_clock_find_piece(clock, time_q42_s, PROGRAM_CLOCK_MOST_ENDS);
    return time_q42_s;
}

/* Enters the piece that the time is in; gives program_clock_time_q42. */
static inline uint64_t program_clock_enter(struct program_clock *clock)
{
    const uint64_t time_q42_s = program_clock_time_q42(clock);
    return time_q42_s < clock->record->end_q42_s ? time_q42_s
                                                 : program_clock_pass_end(clock, time_q42_s);
}

#endif
