/* SPDX-License-Identifier: MIT */
/*
 * What the files of the timebase share: how its time is kept, and how it goes on to the next pieces. Inline, since every
 * tick does it.
 */
#ifndef HODOGRAPH_CORE_TIMEBASE_PRIVATE_H
#define HODOGRAPH_CORE_TIMEBASE_PRIVATE_H

#include <stddef.h>

#include "core/prepared.h"
#include "core/qmath.h"
#include "core/timebase.h"

#define TIMEBASE_REST_UNIT                                                                         \
    15625u /* 10^6 = 15625 * 2^6: periods in 2^-42 s are multiples of 1/15625 */
#define TIMEBASE_FINE_BITS 20
#define TIMEBASE_FINE      10 /* from q32 to q42 */
#define TIMEBASE_MOST_ENDS 2u /* piece ends in a tick, protocol.md 1.3 */

/* The first tick, which goes nowhere: gives the time begun at. Tick context. */
uint64_t timebase_start(struct timebase *tb);

/* Any other tick that is not steady: the rate may change, or what is wanted of it. Tick context. */
void timebase_change(struct timebase *tb);

/* timebase_time_q42. */
static inline uint64_t timebase_rounded_q42(const struct timebase *tb)
{
    if (tb->fine == 0) {
        return tb->time_q42_s + (2u * tb->rest > TIMEBASE_REST_UNIT ? 1u : 0u);
    }
    uint64_t rest = ((uint64_t)tb->rest << TIMEBASE_FINE_BITS) +
                    qmath_product_unsigned(tb->fine, TIMEBASE_REST_UNIT);
    uint64_t half = (uint64_t)TIMEBASE_REST_UNIT << (TIMEBASE_FINE_BITS - 1);
    if (rest <= half) {
        return tb->time_q42_s;
    }
    return tb->time_q42_s + (rest > 3u * half ? 2u : 1u);
}

/* A tick at rate 1, exact. */
static inline void timebase_advance_period(struct timebase *tb)
{
    uint64_t time_q42_s = tb->time_q42_s + tb->period_q42_s;
    uint32_t rest = tb->rest + tb->period_rest;
    if (rest >= TIMEBASE_REST_UNIT) {
        rest -= TIMEBASE_REST_UNIT;
        time_q42_s++;
    }
    tb->time_q42_s = time_q42_s;
    tb->rest = rest;
}

static inline void timebase_advance_q62(struct timebase *tb, uint64_t way_q62_s)
{
    uint64_t sum = tb->fine + way_q62_s;
    tb->time_q42_s += sum >> TIMEBASE_FINE_BITS;
    tb->fine = (uint32_t)sum & ((1u << TIMEBASE_FINE_BITS) - 1u);
}

/* At rest the way of one tick is that of the next. */
static inline void timebase_advance_even(struct timebase *tb)
{
    if (tb->now.rate_q57 == RATE_ONE) {
        timebase_advance_period(tb);
    } else {
        timebase_advance_q62(tb, tb->even_q62_s);
    }
}

/* The last piece ends with the program. */
static inline uint64_t timebase_end_q42_s(const struct timebase *tb, uint64_t end_q42)
{
    return tb->piece + 1u == tb->program->header.piece_count ? tb->duration_q42_s : end_q42;
}

/* Of a program without records. */
static inline void timebase_read_ends(struct timebase *tb, uint64_t time_q42_s, uint32_t most)
{
    for (; time_q42_s >= tb->piece_end_q42_s && most > 0; most--) {
        tb->piece++;
        uint64_t length_q32_s = program_piece_duration(tb->program, tb->piece);
        tb->piece_end_q42_s =
            timebase_end_q42_s(tb, tb->piece_end_q42_s + (length_q32_s << TIMEBASE_FINE));
    }
}

/* The time is not in the present piece, nor at the end of the program: goes to the one that it is in, crossing
 * `most` ends at most. When they are not enough, the piece ends before the time, which interp_at_piece refuses. */
static inline void timebase_find_piece(struct timebase *tb, uint64_t time_q42_s, uint32_t most)
{
    const struct prepared_piece *record = tb->record;
    const uint64_t time_q32_s = time_q42_s >> TIMEBASE_FINE;
    uint32_t left = most;
    if (record == NULL) {
        timebase_read_ends(tb, time_q42_s, most);
        return;
    }
    do {
        record = prepared_piece_next(record, tb->program->prepared_for);
        left--;
    } while (time_q32_s >= record->end_q32_s && left > 0);
    tb->record = record;
    tb->piece += most - left;
    tb->piece_end_q42_s = record->end_q32_s << TIMEBASE_FINE;
}

#endif
