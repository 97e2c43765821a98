/* SPDX-License-Identifier: MIT */
/* Implements core/piece_check.h (see there): the rules of feed pieces (docs/reference/protocol.md 1.3). A part of
 * program_check. Pure, main loop. */
#include "core/piece_check.h"

#include "core/feed_bounds.h"
#include "core/qmath.h"

#define COEFFICIENT_LIMIT_Q40 ((int64_t)1 << 54)  /* 2^14 mm */
#define ARC_LIMIT_Q40         ((int64_t)1 << 62)  /* 2^22 mm */
#define LONGEST_Q44           ((int64_t)32 << 44) /* 32 mm */
#define MOST_DURATION_Q32     ((uint64_t)1 << 54) /* 2^22 s */
#define JOIN_Q44              ((int64_t)1 << 10)  /* 2^-34 mm */
#define JOIN_FEED_Q24         ((int64_t)1 << 8)   /* 2^-16 mm/s */
#define JOIN_ACCELERATION_Q16 ((int64_t)1 << 10)  /* 2^-6 mm/s^2 */
#define OVERRIDE_ONE          (1u << 24)

static int within(int64_t a, int64_t tolerance)
{
    return a <= tolerance && a >= -tolerance;
}

static int check_ranges(const struct program_piece *c)
{
    if (c->duration_q32_s == 0 || c->duration_q32_s > MOST_DURATION_Q32) {
        return PROGRAM_ERR_PIECE_DURATION;
    }
    for (int k = 0; k < 7; k++) {
        if (!within(c->c_q40_mm[k], COEFFICIENT_LIMIT_Q40)) {
            return PROGRAM_ERR_COEFFICIENT;
        }
    }
    return c->start_q40_mm >= 0 && c->start_q40_mm < ARC_LIMIT_Q40 ? 0 : PROGRAM_ERR_ARC_RANGE;
}

/* 2^24 / 1000 = 2^21 / 125 */
static int64_t milli_q24(uint32_t a)
{
    return a == 0 ? FEED_NO_BOUND_Q24 : (int64_t)(qmath_div_u64((uint64_t)a << 21, 125u));
}

static int check_bounds(const struct program_piece *c, const struct program_limits *limits)
{
    int64_t feed = milli_q24(limits->feed_um_s);
    int64_t acceleration = milli_q24(limits->acceleration_um_s2);
    int64_t jerk = limits->jerk_mm_s3 == 0 ? FEED_NO_BOUND_Q24 : (int64_t)limits->jerk_mm_s3 << 24;
    if (!feed_bounds_within(c, FEED_VELOCITY, -FEED_LEAST_Q24, FEED_NO_BOUND_Q24) ||
        !feed_bounds_contained(c)) {
        return PROGRAM_ERR_BACKWARDS;
    }
    if (!feed_bounds_within(c, FEED_VELOCITY, -FEED_LEAST_Q24, feed)) {
        return PROGRAM_ERR_FEED;
    }
    if (!feed_bounds_within(c, FEED_ACCELERATION, -acceleration, acceleration)) {
        return PROGRAM_ERR_ACCELERATION;
    }
    return feed_bounds_within(c, FEED_JERK, -jerk, jerk) ? 0 : PROGRAM_ERR_JERK;
}

static int check_override(const struct program_piece *c)
{
    const struct program_override *own = &c->override;
    int good =
        c->override_factor_q24 >= OVERRIDE_ONE && c->override_factor_q24 <= 2u * OVERRIDE_ONE;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        good = good && own->rate[k] != 0 && own->second[k] != 0;
    }
    return good ? 0 : PROGRAM_ERR_OVERRIDE;
}

static int check_one(const struct program_piece *c, const struct program_limits *limits)
{
    struct feed_state end;
    int code = check_ranges(c);
    if (code != 0) {
        return code;
    }
    feed_bounds_end(c, &end);
    if (!within(end.arc_length_q44_mm, LONGEST_Q44)) {
        return PROGRAM_ERR_PIECE_LONG;
    }
    code = check_bounds(c, limits);
    return code != 0 ? code : check_override(c);
}

/* End of one piece (absolute start and state) against the start of the next; a piece may not end
 * after its start. */
static int check_join(const struct program_piece *a, const struct program_piece *b)
{
    struct feed_state end;
    struct feed_state start;
    feed_bounds_end(a, &end);
    feed_bounds_start(b, &start);
    int64_t advance_q40 = b->start_q40_mm - a->start_q40_mm;
    if (advance_q40 < 0) {
        return PROGRAM_ERR_BACKWARDS;
    }
    if (advance_q40 > ((int64_t)1 << 50) ||
        !within(end.arc_length_q44_mm - advance_q40 * 16, JOIN_Q44)) {
        return PROGRAM_ERR_JOIN_LENGTH;
    }
    if (!within(end.feed_q24_mm_s - start.feed_q24_mm_s, JOIN_FEED_Q24)) {
        return PROGRAM_ERR_JOIN_FEED;
    }
    return within(end.acceleration_q16_mm_s2 - start.acceleration_q16_mm_s2, JOIN_ACCELERATION_Q16)
               ? 0
               : PROGRAM_ERR_JOIN_ACCELERATION;
}

static int at_rest(const struct feed_state *s)
{
    return within(s->feed_q24_mm_s, JOIN_FEED_Q24) &&
           within(s->acceleration_q16_mm_s2, JOIN_ACCELERATION_Q16);
}

/* Of a chunk that begins in motion: inside the first segment. */
static int check_first_moving(const struct program *p, const struct program_piece *c)
{
    const int64_t end_q40_mm =
        p->header.segment_count > 1u ? program_segment_start(p, 1u) : p->header.length_q40_mm;
    return c->start_q40_mm < end_q40_mm ? 0 : PROGRAM_ERR_PIECE_FIRST;
}

static int check_first(const struct program *p, const struct program_piece *c)
{
    struct feed_state start;
    if ((p->header.flags & PROGRAM_FLAG_MOVING) != 0) {
        return check_first_moving(p, c);
    }
    feed_bounds_start(c, &start);
    if (c->start_q40_mm != 0) {
        return PROGRAM_ERR_PIECE_FIRST;
    }
    return at_rest(&start) ? 0 : PROGRAM_ERR_START_MOVING;
}

static int check_last(const struct program *p, const struct program_piece *c)
{
    struct feed_state end;
    feed_bounds_end(c, &end);
    if (!at_rest(&end)) {
        return PROGRAM_ERR_END_MOVING;
    }
    int64_t advance_q40 = p->header.length_q40_mm - c->start_q40_mm;
    int good = within(advance_q40, (int64_t)1 << 50) &&
               within(end.arc_length_q44_mm - advance_q40 * 16, JOIN_Q44);
    return good ? 0 : PROGRAM_ERR_PIECE_END;
}

/* Two whole pieces between others last longer than two periods: 15625 d > 2 period_us 2^26. */
static int lasts_long_enough(const struct program *p, uint64_t two_pieces_q32)
{
    uint64_t limited = two_pieces_q32 > ((uint64_t)1 << 40) ? (uint64_t)1 << 40 : two_pieces_q32;
    return limited * 15625u > (uint64_t)p->header.period_us << 27;
}

static int check_adjacent(const struct program *p, uint32_t i, const struct program_piece *before,
                          const struct program_piece *c)
{
    if (i == 0) {
        return check_first(p, c);
    }
    int code = check_join(before, c);
    if (code == 0 && i >= 2 && i + 1 < p->header.piece_count &&
        !lasts_long_enough(p, before->duration_q32_s + c->duration_q32_s)) {
        code = PROGRAM_ERR_PIECE_SHORT;
    }
    return code;
}

int piece_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index)
{
    struct program_piece before;
    struct program_piece c;
    uint64_t sum = 0;
    program_piece_get(p, 0, &before);
    for (*index = 0; *index < p->header.piece_count; (*index)++) {
        program_piece_get(p, *index, &c);
        int code = check_one(&c, limits);
        code = code != 0 ? code : check_adjacent(p, *index, &before, &c);
        if (code != 0) {
            return code;
        }
        sum += c.duration_q32_s;
        if (sum >= MOST_DURATION_Q32) { /* in 2^-42 s it must fit 64 bits */
            return PROGRAM_ERR_DURATION;
        }
        before = c;
        program_limits_attend(limits);
    }
    *index = p->header.piece_count - 1u;
    int code = check_last(p, &before);
    *index = code != 0 ? *index : 0;
    return code != 0 ? code : sum == p->header.duration_q32_s ? 0 : PROGRAM_ERR_DURATION;
}
