/* SPDX-License-Identifier: MIT */
/* Implements core/interpolator.h (see there): program time in, point on the path out. Used by core, app/machine,
 * sim/offline and host tools. Main loop or tick, as each function states. Changes only its struct; no I/O. */
#include "core/interpolator.h"

#include <stddef.h>

#include "core/qmath.h"

#define MOST_ENDS 2u /* piece ends and segment ends a tick may cross: protocol.md 1.2 and 1.3 */

/* Arc length is kept inside the path: a feed that dips below zero by rounding must not leave it. */
static void evaluate_feed(const struct interpolator *it, const struct coefficients_piece *piece,
                          uint64_t time_q42_s, struct feed_point *f)
{
    it->kernel->piece_at(&piece->feed, f, time_q42_s - piece->start_q42_s);
    if (f->arc_length_q40_mm < 0) {
        f->arc_length_q40_mm = 0;
    } else if (f->arc_length_q40_mm > it->length_q40_mm) {
        f->arc_length_q40_mm = it->length_q40_mm;
    }
}

/* Makes the piece of this time, below the duration, the present one, crossing `most` ends at most. */
static int find_piece(struct interpolator *it, uint64_t time_q42_s, uint32_t most)
{
    const struct coefficients_piece *piece = it->piece;
    if (time_q42_s < piece->start_q42_s) {
        return INTERPOLATOR_ERR_JUMP;
    }
    for (; time_q42_s >= piece->end_q42_s; most--) {
        if (most == 0 || piece->next == 0) {
            return INTERPOLATOR_ERR_JUMP;
        }
        piece = coefficients_piece_next(piece);
    }
    it->piece = piece;
    return INTERPOLATOR_OK;
}

static int step_segment(struct interpolator *it, int64_t arc_length_q40_mm, uint32_t most)
{
    const struct coefficients_segment *segment = it->segment;
    uint32_t left = most;
    if (arc_length_q40_mm >= segment->to_q40_mm) {
        do {
            if (left-- == 0) {
                return INTERPOLATOR_ERR_JUMP;
            }
            segment = coefficients_segment_next(segment);
        } while (arc_length_q40_mm >= segment->to_q40_mm);
    } else {
        do {
            if (left-- == 0) {
                return INTERPOLATOR_ERR_JUMP;
            }
            segment = coefficients_segment_back(segment);
        } while (arc_length_q40_mm < segment->from_q40_mm);
    }
    it->segment = segment;
    return INTERPOLATOR_OK;
}

/* Makes the segment of this arc length the present one: the last that starts at or before it. Steps
 * back only where the feed dips below zero by rounding. */
static int find_segment(struct interpolator *it, int64_t arc_length_q40_mm, uint32_t most)
{
    const struct coefficients_segment *segment = it->segment;
    if (arc_length_q40_mm >= segment->from_q40_mm && arc_length_q40_mm < segment->to_q40_mm) {
        return INTERPOLATOR_OK;
    }
    return step_segment(it, arc_length_q40_mm, most);
}

static void set_start(struct interpolator_point *start, const struct program *p,
                      const struct kernel *kernel)
{
    struct coefficients_segment record;
    struct program_segment segment;
    struct ph_segment ph;
    const struct kernel_path *path = kernel_path(kernel, p->header.axis_count);
    program_segment_get(p, 0, &segment);
    ph_segment_expand(&ph, &segment);
    path->segment_set(&record.path, &ph);
    path->segment_at(&record.path, start->position_q40, 0);
    start->arc_length_q40_mm = 0;
    start->feed_q32_mm_s = 0;
}

void interpolator_exact_end(const struct program *p, struct interpolator_point *end)
{
    struct program_segment segment;
    struct ph_segment ph;
    int64_t end_q48[PH_AXES];
    program_segment_get(p, p->header.segment_count - 1u, &segment);
    ph_segment_expand(&ph, &segment);
    ph_segment_end(&ph, end_q48);
    end->arc_length_q40_mm = p->header.length_q40_mm;
    end->feed_q32_mm_s = 0;
    for (uint32_t axis = 0; axis < program_curve_axes(segment.axis_count); axis++) {
        end->position_q40[axis] =
            segment.point_q40_mm[axis] + qmath_round(end_q48[PH_X + (int)axis], 8);
    }
    for (uint32_t i = 0; i < program_extra_axes(segment.axis_count); i++) {
        end->position_q40[PROGRAM_SPACE + i] =
            segment.extra[i].start_q40 + segment.extra[i].b_q40[4];
    }
}

void interpolator_point_copy_others(struct interpolator_point *out,
                                    const struct interpolator_point *from, uint32_t axis_count)
{
    for (uint32_t axis = PROGRAM_PLANE; axis < axis_count && axis < PROGRAM_AXES; axis++) {
        out->position_q40[axis] = from->position_q40[axis];
    }
}

void interpolator_ends(const struct program *p, const struct kernel *kernel,
                       struct interpolator_point *first, struct interpolator_point *last)
{
    set_start(first, p, kernel);
    interpolator_exact_end(p, last);
}

void interpolator_begin_window(struct interpolator *it, const struct program *p,
                               const struct coefficients_window *window)
{
    it->program = p;
    it->kernel = window->kernel;
    it->axis_count = p->header.axis_count;
    it->segment_at = kernel_path(it->kernel, it->axis_count)->segment_at;
    it->duration_q42_s = qmath_q42_of_q32(p->header.duration_q32_s);
    it->length_q40_mm = p->header.length_q40_mm;
    it->window = *window;
    it->piece = coefficients_window_piece(window, 0);
    it->segment = coefficients_window_segment(window, 0);
    interpolator_exact_end(p, &it->end);
}

int interpolator_begin(struct interpolator *it, const struct program *p)
{
    struct coefficients_window all;
    if (p == NULL || p->image == NULL) {
        return INTERPOLATOR_ERR_PROGRAM;
    }
    if (p->coefficients_for == NULL) {
        return INTERPOLATOR_ERR_COEFFICIENTS;
    }
    coefficients_window_of(&all, p);
    interpolator_begin_window(it, p, &all);
    return 0;
}

void interpolator_use(struct interpolator *it, const struct coefficients_window *window)
{
    it->segment = coefficients_window_segment(window, it->segment->number);
    it->piece = coefficients_window_piece(window, window->first_piece);
    it->window = *window;
}

const struct coefficients_segment *interpolator_segment_in(const struct coefficients_window *window,
                                                           int64_t number,
                                                           int64_t arc_length_q40_mm)
{
    struct interpolator at = {
        .segment = coefficients_window_segment(window, number > 0 ? (uint32_t)number : 0u)};
    return at.segment != NULL && find_segment(&at, arc_length_q40_mm, INTERPOLATOR_MOST_SEGMENTS) ==
                                     INTERPOLATOR_OK
               ? at.segment
               : NULL;
}

void interpolator_carry(struct interpolator *it, const struct program *p,
                        const struct coefficients_window *window,
                        const struct coefficients_segment *segment,
                        const struct interpolator_point *end)
{
    it->program = p;
    it->duration_q42_s = qmath_q42_of_q32(p->header.duration_q32_s);
    it->length_q40_mm = p->header.length_q40_mm;
    it->window = *window;
    it->piece = coefficients_window_piece(window, window->first_piece);
    it->segment = segment;
    it->end = *end;
}

/* Beyond the end of the piece: the last one ends with the program. */
static int beyond(const struct interpolator *it, uint64_t time_q42_s,
                  struct interpolator_point *out)
{
    if (time_q42_s < it->duration_q42_s) {
        return INTERPOLATOR_ERR_JUMP;
    }
    interpolator_point_copy(out, &it->end, it->axis_count);
    return INTERPOLATOR_END;
}

/* Arc length inside the path. */
static int evaluate_path(struct interpolator *it, int64_t arc_length_q40_mm, uint32_t most,
                         struct interpolator_point *out)
{
    if (find_segment(it, arc_length_q40_mm, most) != INTERPOLATOR_OK) {
        return INTERPOLATOR_ERR_JUMP;
    }
    it->segment_at(&it->segment->path, out->position_q40, arc_length_q40_mm);
    out->arc_length_q40_mm = arc_length_q40_mm;
    return INTERPOLATOR_OK;
}

int interpolator_at_piece(struct interpolator *it, const struct coefficients_piece *piece,
                          uint64_t time_q42_s, struct interpolator_point *out)
{
    if (time_q42_s >= piece->end_q42_s) {
        return beyond(it, time_q42_s, out);
    }
    struct feed_point f;
    evaluate_feed(it, piece, time_q42_s, &f);
    if (evaluate_path(it, f.arc_length_q40_mm, MOST_ENDS, out) != INTERPOLATOR_OK) {
        return INTERPOLATOR_ERR_JUMP;
    }
    out->feed_q32_mm_s = f.feed_q32_mm_s;
    return INTERPOLATOR_OK;
}

int interpolator_at_q42(struct interpolator *it, uint64_t time_q42_s,
                        struct interpolator_point *out)
{
    if (time_q42_s < it->duration_q42_s &&
        find_piece(it, time_q42_s, MOST_ENDS) != INTERPOLATOR_OK) {
        return INTERPOLATOR_ERR_JUMP;
    }
    return interpolator_at_piece(it, it->piece, time_q42_s, out);
}

int interpolator_at_arc_length(struct interpolator *it, int64_t arc_length_q40_mm,
                               struct interpolator_point *out)
{
    const int64_t inside = qmath_lesser(qmath_greater(arc_length_q40_mm, 0), it->length_q40_mm);
    const int result = evaluate_path(it, inside, INTERPOLATOR_MOST_SEGMENTS, out);
    if (result == INTERPOLATOR_OK) {
        out->feed_q32_mm_s = 0;
    }
    return result;
}

int64_t interpolator_acceleration_q40(const struct interpolator *it,
                                      const struct coefficients_piece *piece, uint64_t time_q42_s)
{
    return it->kernel->piece_acceleration(&piece->feed, time_q42_s - piece->start_q42_s);
}

void interpolator_search_begin(struct interpolator_search *search, uint32_t index,
                               int64_t arc_length_q40_mm)
{
    search->arc_length_q40_mm = arc_length_q40_mm;
    search->time_q42_s = 0;
    search->piece = NULL;
    search->piece_index = index;
    search->bisecting = 0;
}

/* On by a piece, or into it. */
static void find_place(const struct interpolator *it, struct interpolator_search *search)
{
    const struct program *p = it->program;
    const uint32_t next = search->piece_index + 1u;
    if (next < p->header.piece_count && program_piece_start(p, next) <= search->arc_length_q40_mm) {
        search->piece_index = next;
        return;
    }
    const struct coefficients_piece *piece =
        coefficients_window_piece(&it->window, search->piece_index);
    if (piece != NULL) {
        search->piece = piece;
        search->low_q42_s = piece->start_q42_s;
        search->high_q42_s = piece->end_q42_s - 1u;
        search->bisecting = 1;
    }
}

int interpolator_search_step(const struct interpolator *it, struct interpolator_search *search)
{
    if (search->bisecting == 0) {
        find_place(it, search);
        return 0;
    }
    if (search->low_q42_s < search->high_q42_s) {
        struct feed_point f;
        const uint64_t middle = search->low_q42_s + (search->high_q42_s - search->low_q42_s) / 2u;
        evaluate_feed(it, search->piece, middle, &f);
        if (f.arc_length_q40_mm >= search->arc_length_q40_mm) {
            search->high_q42_s = middle;
        } else {
            search->low_q42_s = middle + 1u;
        }
    }
    search->time_q42_s = search->low_q42_s;
    return search->low_q42_s == search->high_q42_s;
}

int interpolator_at(struct interpolator *it, uint64_t time_q32_s, struct interpolator_point *out)
{
    const uint64_t duration_q32_s = qmath_q32_of_q42(it->duration_q42_s);
    const uint64_t time_q32_s_inside = time_q32_s < duration_q32_s ? time_q32_s : duration_q32_s;
    return interpolator_at_q42(it, qmath_q42_of_q32(time_q32_s_inside), out);
}

int interpolator_seek(struct interpolator *it, uint64_t time_q32_s)
{
    const uint64_t last_q32_s = qmath_q32_of_q42(it->duration_q42_s) - 1u;
    const uint64_t time_q42_s = qmath_q42_of_q32(time_q32_s < last_q32_s ? time_q32_s : last_q32_s);
    struct feed_point f;
    if (time_q42_s < it->piece->start_q42_s) {
        it->piece = coefficients_window_piece(&it->window, 0);
    }
    find_piece(it, time_q42_s, UINT32_MAX);
    evaluate_feed(it, it->piece, time_q42_s, &f);
    find_segment(it, f.arc_length_q40_mm, UINT32_MAX);
    return 0;
}
