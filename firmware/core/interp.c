/* SPDX-License-Identifier: MIT */
#include "core/interp.h"

#include <stddef.h>

#include "core/qmath.h"

#define FINE_BITS 10 /* from q32 to q42 */
#define MOST_ENDS 2u /* piece ends and segment ends a tick may cross: protocol.md 1.2 and 1.3 */

static void load_piece(struct interp *it, uint32_t i, uint64_t start_q32_s)
{
    struct program_piece piece;
    program_piece_get(it->program, i, &piece);
    it->piece = i;
    it->piece_start_q32_s = start_q32_s;
    it->piece_end_q32_s = start_q32_s + piece.duration_q32_s;
    it->kernel->piece_set(&it->feed, &piece);
}

static void load_segment(struct interp *it, uint32_t i)
{
    struct program_segment segment;
    struct ph_segment ph;
    program_segment_get(it->program, i, &segment);
    ph_segment_expand(&ph, &segment);
    it->segment = i;
    it->segment_start_q40_mm = i == 0 ? INT64_MIN : segment.start_q40_mm;
    it->segment_end_q40_mm = i + 1 == it->program->header.segment_count
                                 ? INT64_MAX
                                 : program_segment_start(it->program, i + 1);
    it->kernel->segment_set(&it->path, &ph);
}

/* Arc length is kept inside the path: a feed that dips below zero by rounding must not leave it. */
static void evaluate_feed(const struct interp *it, uint64_t time_q42_s, struct feed_point *f)
{
    uint64_t t = time_q42_s - (it->piece_start_q32_s << FINE_BITS);
    it->kernel->piece_at(&it->feed, t, f);
    int64_t length = it->program->header.length_q40_mm;
    f->arc_length_q40_mm = f->arc_length_q40_mm < 0 ? 0 : f->arc_length_q40_mm;
    f->arc_length_q40_mm = f->arc_length_q40_mm > length ? length : f->arc_length_q40_mm;
}

/* Makes the piece of this time the loaded one, crossing `most` ends at most. The last piece has no
 * end here: beyond the duration nothing is evaluated. */
static int find_piece(struct interp *it, uint64_t time_q32_s, uint32_t most)
{
    uint32_t i = it->piece;
    uint64_t start = it->piece_start_q32_s;
    uint64_t end = it->piece_end_q32_s;
    if (time_q32_s < start) {
        return INTERP_ERR_JUMP;
    }
    while (time_q32_s >= end && i + 1 < it->program->header.piece_count) {
        if (most == 0) {
            return INTERP_ERR_JUMP;
        }
        most--;
        i++;
        start = end;
        end += program_piece_duration(it->program, i);
    }
    if (i != it->piece) {
        load_piece(it, i, start);
    }
    return INTERP_OK;
}

/* Makes the segment of this arc length the loaded one: the last that starts at or before it. Steps
 * back only where the feed dips below zero by rounding. */
static int find_segment(struct interp *it, int64_t arc_length_q40_mm, uint32_t most)
{
    const struct program *p = it->program;
    uint32_t i = it->segment;
    if (arc_length_q40_mm >= it->segment_start_q40_mm &&
        arc_length_q40_mm < it->segment_end_q40_mm) {
        return INTERP_OK;
    }
    while (i + 1 < p->header.segment_count &&
           program_segment_start(p, i + 1) <= arc_length_q40_mm) {
        if (most == 0) {
            return INTERP_ERR_JUMP;
        }
        most--;
        i++;
    }
    while (i > 0 && program_segment_start(p, i) > arc_length_q40_mm) {
        if (most == 0) {
            return INTERP_ERR_JUMP;
        }
        most--;
        i--;
    }
    load_segment(it, i);
    return INTERP_OK;
}

static void set_end(struct interp *it)
{
    struct program_segment segment;
    struct ph_segment ph;
    int64_t end_q48[3];
    program_segment_get(it->program, it->program->header.segment_count - 1u, &segment);
    ph_segment_expand(&ph, &segment);
    ph_segment_end(&ph, end_q48);
    it->end.arc_length_q40_mm = it->program->header.length_q40_mm;
    it->end.x_q40_mm = segment.x_q40_mm + qmath_round(end_q48[PH_X], 8);
    it->end.y_q40_mm = segment.y_q40_mm + qmath_round(end_q48[PH_Y], 8);
    it->end.feed_q32_mm_s = 0;
}

int interp_begin(struct interp *it, const struct program *p, enum interp_kernel kernel)
{
    if (p == NULL || p->image == NULL) {
        return INTERP_ERR_PROGRAM;
    }
    it->kernel = kernel_find((uint32_t)kernel);
    if (it->kernel == NULL) {
        return INTERP_ERR_KERNEL;
    }
    it->program = p;
    set_end(it);
    load_piece(it, 0, 0);
    load_segment(it, 0);
    return 0;
}

int interp_at_q42(struct interp *it, uint64_t time_q42_s, struct interp_point *out)
{
    uint64_t time_q32_s = time_q42_s >> FINE_BITS;
    if (time_q32_s >= it->program->header.duration_q32_s) {
        *out = it->end;
        return INTERP_END;
    }
    struct feed_point f;
    if (find_piece(it, time_q32_s, MOST_ENDS) != INTERP_OK) {
        return INTERP_ERR_JUMP;
    }
    evaluate_feed(it, time_q42_s, &f);
    if (find_segment(it, f.arc_length_q40_mm, MOST_ENDS) != INTERP_OK) {
        return INTERP_ERR_JUMP;
    }
    int64_t point[2];
    it->kernel->segment_at(&it->path, f.arc_length_q40_mm, point);
    out->arc_length_q40_mm = f.arc_length_q40_mm;
    out->x_q40_mm = point[0];
    out->y_q40_mm = point[1];
    out->feed_q32_mm_s = f.feed_q32_mm_s;
    return INTERP_OK;
}

int interp_at(struct interp *it, uint64_t time_q32_s, struct interp_point *out)
{
    uint64_t duration = it->program->header.duration_q32_s;
    uint64_t time = time_q32_s < duration ? time_q32_s : duration;
    return interp_at_q42(it, time << FINE_BITS, out);
}

int interp_seek(struct interp *it, uint64_t time_q32_s)
{
    uint64_t last = it->program->header.duration_q32_s - 1u;
    uint64_t time = time_q32_s < last ? time_q32_s : last;
    struct feed_point f;
    if (time < it->piece_start_q32_s) {
        load_piece(it, 0, 0);
    }
    find_piece(it, time, UINT32_MAX);
    evaluate_feed(it, time << FINE_BITS, &f);
    find_segment(it, f.arc_length_q40_mm, UINT32_MAX);
    return 0;
}
