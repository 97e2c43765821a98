/* SPDX-License-Identifier: MIT */
/* Implements core/segment_length_check.h (see there): minimum segment length. Used by program_check and event_check.
 * Main loop. Changes only its result; no I/O. */
#include "core/segment_length_check.h"

#include "core/feed_bounds.h"

/* How far a piece may reach beyond its two ends (FEED_PIECE_SLACK), and a gap at a joint. */
#define REACH_Q40 (FEED_PIECE_SLACK_Q36 * 32)

static int64_t piece_start(const struct program *p, uint32_t i)
{
    struct program_piece c;
    program_piece_get(p, i, &c);
    return c.start_q40_mm;
}

/* Feed at which a tick of twice the period covers this length: length 10^6 / (2 period_us). */
static int64_t covering_feed_q24(const struct program *p, int64_t length_q40)
{
    uint32_t half_frequency =
        4000000u / p->header.period_us; /* times 8: an integer for each period */
    return (length_q40 >> 16) * (int64_t)half_frequency / 8 - 1;
}

int length_exceeds_tick(const struct program *p, int64_t from_q40_mm, int64_t to_q40_mm,
                        uint32_t *first)
{
    int64_t feed = covering_feed_q24(p, to_q40_mm - from_q40_mm);
    if (feed < FEED_LEAST_Q24) {
        return 0;
    }
    while (*first + 1 < p->header.piece_count &&
           piece_start(p, *first + 1u) < from_q40_mm - REACH_Q40) {
        (*first)++;
    }
    for (uint32_t i = *first; i < p->header.piece_count; i++) {
        struct program_piece c;
        program_piece_get(p, i, &c);
        if (c.start_q40_mm > to_q40_mm + REACH_Q40) {
            break;
        }
        if (!feed_bounds_within(&c, FEED_VELOCITY, -FEED_NO_BOUND_Q24, feed)) {
            return 0;
        }
    }
    return 1;
}

int segment_length_check_all(const struct program *p, uint32_t *index)
{
    uint32_t piece = 0;
    for (*index = 1; (uint64_t)*index + 2u < p->header.segment_count; (*index)++) {
        int64_t from = program_segment_start(p, *index);
        int64_t to = program_segment_start(p, *index + 2u);
        if (!length_exceeds_tick(p, from, to, &piece)) {
            (*index)++;
            return PROGRAM_ERR_SEGMENT_SHORT;
        }
    }
    *index = 0;
    return 0;
}
