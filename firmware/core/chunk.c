/* SPDX-License-Identifier: MIT */
/* Implements core/chunk.h (see there): a chunk, a part of a job that is longer than the controller's memory: reading
 * and checking it. Used by firmware/app, core/feed_override, sim/offline/stream and host tools. Main loop; the inline
 * functions in any context. Changes only its arguments; no I/O. */
#include "core/chunk.h"

#include <stddef.h>
#include <string.h>

#include "core/crc32.h"
#include "core/first_axis.h"
#include "core/little_endian.h"
#include "core/override_ramp.h"
#include "core/program_check.h"

#define CRC_AT        12u /* the CRC covers everything but the magic before it and itself */
#define CRC_FROM      16u /* offset of the first byte that the CRC covers */
#define ARC_LIMIT_Q40 ((int64_t)1 << 62)  /* 2^22 mm */
#define MEETS_Q40     ((uint64_t)1 << 16) /* 2^-24 mm: how far an end may be from the next start */
#define REST_FLAGS    (CHUNK_REST_STOP | CHUNK_REST_OPTIONAL)
#define FLAGS         (CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST | CHUNK_FLAG_REST | CHUNK_FLAG_JOINED)

static void read_header(struct chunk *c, const uint8_t *b)
{
    c->flags = read_u16(b + 6);
    c->size = read_u32(b + 8);
    c->job = read_u32(b + 16);
    c->sequence = read_u32(b + 20);
    c->piece_shift = read_u32(b + 24);
    c->segment_shift = read_u32(b + 28);
    c->shared_pieces = read_u32(b + 32);
    c->shared_segments = read_u32(b + 36);
    c->arc_shift_q40_mm = read_i64(b + 40);
    c->time_shift_q32_s = read_u64(b + 48);
    c->job_start_q40_mm = read_i64(b + 56);
    c->line = read_u32(b + 64);
    c->remaining_ms = read_u32(b + 68);
    c->rest_ms = read_u32(b + 72);
    c->rest_flags = read_u32(b + 76);
}

static uint32_t crc_of(const uint8_t *bytes, uint32_t size)
{
    const uint32_t before = crc32_update(0, bytes + 4, CRC_AT - 4u);
    return crc32_update(before, bytes + CRC_FROM, size - CRC_FROM);
}

static int flags_fit(const struct chunk *c)
{
    const int rests = chunk_begins_at_rest(c);
    const int joined = chunk_is_joined(c);
    return (c->flags & ~FLAGS) == 0u && (c->rest_flags & ~REST_FLAGS) == 0u &&
           (rests || (c->rest_ms | c->rest_flags) == 0u) && !(joined && !chunk_goes_on(c));
}

int chunk_open(struct chunk *c, const uint8_t *bytes, uint32_t size)
{
    if (bytes == NULL || size < CHUNK_HEADER_SIZE || memcmp(bytes, "HDGC", 4) != 0 ||
        read_u16(bytes + 4) != CHUNK_VERSION) {
        return PROGRAM_ERR_CHUNK_FORMAT;
    }
    read_header(c, bytes);
    if (c->size > size || c->size < CHUNK_HEADER_SIZE || !flags_fit(c)) {
        return PROGRAM_ERR_CHUNK_FORMAT;
    }
    if (crc_of(bytes, c->size) != read_u32(bytes + CRC_AT)) {
        return PROGRAM_ERR_CHUNK_CRC;
    }
    const int code =
        program_open(&c->program, bytes + CHUNK_HEADER_SIZE, c->size - CHUNK_HEADER_SIZE);
    if (code != 0) {
        return code;
    }
    return c->program.size == c->size - CHUNK_HEADER_SIZE ? 0 : PROGRAM_ERR_CHUNK_FORMAT;
}

/* --- The first chunk of a job --- */

static int shares_nothing(const struct chunk *c)
{
    const uint64_t shifts = (uint64_t)c->piece_shift | c->segment_shift | c->shared_pieces |
                            c->shared_segments | (uint64_t)c->arc_shift_q40_mm |
                            c->time_shift_q32_s;
    return shifts == 0u && (c->program.header.flags & PROGRAM_FLAG_MOVING) == 0u;
}

static int check_first(const struct chunk *c)
{
    if (c->sequence != 0u) {
        return PROGRAM_ERR_CHUNK_SEQUENCE;
    }
    if ((c->flags & CHUNK_FLAG_FIRST) == 0u || chunk_begins_at_rest(c) || !shares_nothing(c)) {
        return PROGRAM_ERR_CHUNK_FIRST;
    }
    return c->job_start_q40_mm >= 0 && c->job_start_q40_mm < ARC_LIMIT_Q40
               ? 0
               : PROGRAM_ERR_CHUNK_SHARED;
}

/* --- A later chunk compared with its predecessor --- */

/* Rules that need no segments and pieces. */
static int check_follows(const struct chunk *next, const struct chunk *previous)
{
    if (next->sequence != previous->sequence + 1u) {
        return PROGRAM_ERR_CHUNK_SEQUENCE;
    }
    if ((next->flags & CHUNK_FLAG_FIRST) != 0u || !chunk_goes_on(previous)) {
        return PROGRAM_ERR_CHUNK_FIRST;
    }
    if (!chunk_begins_at_rest(next) && chunk_is_joined(previous)) {
        return PROGRAM_ERR_CHUNK_REST;
    }
    const struct program_header *h = &next->program.header;
    const struct program_header *before = &previous->program.header;
    return h->period_us == before->period_us && h->axis_count == before->axis_count &&
                   first_axis(h) == first_axis(before)
               ? 0
               : PROGRAM_ERR_CHUNK_PROGRAM;
}

/* The tail has at least one piece; all segments of the predecessor from the shift on are shared. */
static int counts_fit(const struct chunk *next, const struct chunk *previous)
{
    const struct program_header *h = &next->program.header;
    const struct program_header *before = &previous->program.header;
    return next->shared_pieces > 0u && next->shared_pieces <= h->piece_count &&
           (uint64_t)next->piece_shift + next->shared_pieces < before->piece_count &&
           next->shared_segments > 0u && next->shared_segments <= h->segment_count &&
           (uint64_t)next->segment_shift + next->shared_segments == before->segment_count;
}

static uint64_t time_of_piece_q32_s(const struct program *p, uint32_t piece)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < piece; i++) {
        sum += program_piece_duration(p, i);
    }
    return sum;
}

static int shifts_fit(const struct chunk *next, const struct chunk *previous)
{
    const struct program *before = &previous->program;
    return next->arc_shift_q40_mm == program_segment_start(before, next->segment_shift) &&
           next->time_shift_q32_s == time_of_piece_q32_s(before, next->piece_shift) &&
           next->job_start_q40_mm >= 0 && next->job_start_q40_mm < ARC_LIMIT_Q40 &&
           next->job_start_q40_mm == previous->job_start_q40_mm + next->arc_shift_q40_mm;
}

static int check_segments(const struct chunk *next, const struct chunk *previous, uint32_t *index)
{
    for (*index = 0; *index < next->shared_segments; (*index)++) {
        const uint32_t k = next->segment_shift + *index;
        const int64_t arc_q40 =
            program_segment_start(&previous->program, k) - next->arc_shift_q40_mm;
        if (program_segment_start(&next->program, *index) != arc_q40 ||
            !program_segment_alike(&next->program, *index, &previous->program, k)) {
            return PROGRAM_ERR_CHUNK_SEGMENT;
        }
    }
    *index = 0;
    return 0;
}

static int check_pieces(const struct chunk *next, const struct chunk *previous, uint32_t *index)
{
    for (*index = 0; *index < next->shared_pieces; (*index)++) {
        const uint32_t k = next->piece_shift + *index;
        const int64_t arc_q40 = program_piece_start(&previous->program, k) - next->arc_shift_q40_mm;
        if (program_piece_start(&next->program, *index) != arc_q40 ||
            !program_piece_alike(&next->program, *index, &previous->program, k)) {
            return PROGRAM_ERR_CHUNK_PIECE;
        }
    }
    *index = 0;
    return 0;
}

static int same_event(const struct program *p, uint32_t i, const struct program *before, uint32_t k,
                      int64_t arc_shift_q40_mm)
{
    struct program_event own;
    struct program_event old;
    program_event_get(p, i, &own);
    program_event_get(before, k, &old);
    return own.place_q40_mm == old.place_q40_mm - arc_shift_q40_mm && own.kind == old.kind &&
           own.channel == old.channel && own.mask == old.mask && own.value == old.value;
}

/* Up to the predecessor's end both have the same events, so that the next event is the same one at any time of the
 * takeover. The check of the program finds events of the next chunk in the wrong order. */
static int check_events(const struct chunk *next, const struct chunk *previous, uint32_t *index)
{
    const struct program *before = &previous->program;
    const int64_t shift_q40_mm = next->arc_shift_q40_mm;
    const int64_t end_q40_mm = before->header.length_q40_mm - shift_q40_mm;
    const uint32_t first = program_first_event_from(before, shift_q40_mm);
    const uint32_t wanted = before->header.event_count - first;
    const uint32_t found = program_first_event_from(&next->program, end_q40_mm + 1);
    *index = 0;
    while (*index < wanted && *index < found &&
           same_event(&next->program, *index, before, first + *index, shift_q40_mm)) {
        (*index)++;
    }
    if (*index < wanted || *index < found) {
        return PROGRAM_ERR_CHUNK_EVENT;
    }
    *index = 0;
    return 0;
}

/* --- One that begins at rest --- */

/* The start is not checked yet, so it may be any number: the difference is one of unsigned numbers, which may wrap. An
 * end has a magnitude below 2^62, so a difference that wraps is far from 0. */
static int meets(int64_t start_q40, int64_t end_q40)
{
    const uint64_t off_q40 = (uint64_t)start_q40 - (uint64_t)end_q40;
    return off_q40 + MEETS_Q40 <= 2u * MEETS_Q40;
}

/* Whether it begins at the point where its predecessor ends. */
static int begins_at_end(const struct chunk *next, const struct chunk *previous)
{
    const uint32_t axis_count = next->program.header.axis_count;
    const int64_t *end_q40 = previous->end.position_q40;
    struct program_segment first;
    int same = 1;
    program_segment_get(&next->program, 0, &first);
    for (uint32_t axis = 0; axis < program_curve_axes(axis_count); axis++) {
        same = same && meets(first.point_q40_mm[axis], end_q40[axis]);
    }
    for (uint32_t i = 0; i < program_extra_axes(axis_count); i++) {
        same = same && meets(first.extra[i].start_q40, end_q40[PROGRAM_SPACE + i]);
    }
    return same;
}

static int check_rest(const struct chunk *next, const struct chunk *previous)
{
    const int64_t end_q40_mm = previous->job_start_q40_mm + previous->program.header.length_q40_mm;
    return shares_nothing(next) && next->job_start_q40_mm == end_q40_mm &&
                   next->job_start_q40_mm < ARC_LIMIT_Q40 && begins_at_end(next, previous)
               ? 0
               : PROGRAM_ERR_CHUNK_REST;
}

static int check_shared(const struct chunk *next, const struct chunk *previous, uint32_t *index)
{
    int code = check_follows(next, previous);
    if (chunk_begins_at_rest(next)) {
        return code != 0 ? code : check_rest(next, previous);
    }
    if (code == 0 && (!counts_fit(next, previous) || !shifts_fit(next, previous))) {
        code = PROGRAM_ERR_CHUNK_SHARED;
    }
    code = code != 0 ? code : check_segments(next, previous, index);
    code = code != 0 ? code : check_pieces(next, previous, index);
    return code != 0 ? code : check_events(next, previous, index);
}

int chunk_check(struct chunk *next, const struct chunk *previous,
                const struct program_limits *limits, struct program_fault *fault)
{
    struct program_limits own = *limits;
    fault->index = 0;
    if (next->job == 0u || (previous != NULL && next->job != previous->job)) {
        fault->code = PROGRAM_ERR_CHUNK_JOB;
    } else if (previous == NULL) {
        fault->code = check_first(next);
    } else {
        fault->code = check_shared(next, previous, &fault->index);
    }
    own.chunk = 1;
    if (fault->code == 0 && program_check(&next->program, &own, fault) == 0) {
        next->joint_time_q32_s =
            next->time_shift_q32_s + time_of_piece_q32_s(&next->program, next->shared_pieces);
        override_bounds_of(&next->least, &next->program, 0, next->program.header.piece_count);
        interpolator_exact_end(&next->program, &next->end);
    }
    return fault->code;
}
