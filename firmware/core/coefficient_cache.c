/* SPDX-License-Identifier: MIT */
/* Implements core/coefficient_cache.h (see there): coefficient records near the motion, in two halves of a memory. Used
 * by app/chunk_records and sim/offline/stream. Main loop. Changes only its struct and its memory; no I/O. */
#include "core/coefficient_cache.h"

#include <string.h>

#include "core/qmath.h"

/* Records of pieces stand at the start of a half, in order, those of segments at its end, the first one last. */

/* A window that is being made. */
struct making {
    const struct program *program;
    const struct coefficients_window *have; /* records that may be copied; NULL: none */
    struct coefficients_window *out;
    uint8_t *memory; /* of the half, */
    uint32_t size;   /* and its bytes; */
    uint32_t room;   /* those left */
    uint32_t piece_size;
    uint32_t segment_size;
};

void coefficient_cache_init(struct coefficient_cache *cache, uint8_t *memory, uint32_t size)
{
    memset(cache, 0, sizeof *cache);
    cache->size = size / 2u & ~(COEFFICIENTS_ALIGNMENT - 1u);
    cache->half[0].memory = memory;
    cache->half[1].memory = memory + cache->size;
}

int coefficient_cache_fits(const struct coefficient_cache *cache, const struct kernel *kernel,
                           uint32_t axis_count)
{
    return COEFFICIENT_CACHE_LEAST *
               (coefficients_piece_size(kernel) + coefficients_segment_size(kernel, axis_count)) <=
           cache->size;
}

/* --- Making a window --- */

static uint64_t piece_start_q42_s(const struct program *p, uint32_t piece)
{
    uint64_t sum_q32_s = 0;
    for (uint32_t i = 0; i < piece; i++) {
        sum_q32_s += program_piece_duration(p, i);
    }
    return qmath_q42_of_q32(sum_q32_s);
}

/* Adds the record of the next piece after the last one. */
static void add_piece(struct making *m)
{
    struct coefficients_window *w = m->out;
    const uint32_t i = w->first_piece + w->piece_count;
    uint8_t *at = m->memory + (size_t)w->piece_count * m->piece_size;
    struct coefficients_piece *piece = (struct coefficients_piece *)(void *)at;
    struct coefficients_piece *before =
        w->piece_count > 0u ? (struct coefficients_piece *)(void *)(at - m->piece_size) : NULL;
    const struct coefficients_piece *have =
        m->have != NULL ? coefficients_window_piece(m->have, i) : NULL;
    if (have != NULL) {
        memcpy(piece, have, m->piece_size);
        piece->next = 0;
    } else {
        memset(piece, 0, m->piece_size);
        coefficients_make_piece(piece, m->program, w->kernel, i,
                                before != NULL ? before->end_q42_s
                                               : piece_start_q42_s(m->program, i));
    }
    if (before != NULL) {
        before->next = (int32_t)m->piece_size;
    }
    w->piece_count++;
    m->room -= m->piece_size;
}

/* Adds the record of the next segment, in memory before the last one. */
static void add_segment(struct making *m)
{
    struct coefficients_window *w = m->out;
    const uint32_t i = w->first_segment + w->segment_count;
    uint8_t *at = m->memory + m->size - ((size_t)w->segment_count + 1u) * m->segment_size;
    struct coefficients_segment *segment = (struct coefficients_segment *)(void *)at;
    const struct coefficients_segment *have =
        m->have != NULL ? coefficients_window_segment(m->have, i) : NULL;
    if (have != NULL) {
        memcpy(segment, have, m->segment_size);
        segment->next = 0;
        segment->back = 0;
    } else {
        memset(segment, 0, m->segment_size);
        coefficients_make_segment(segment, m->program, w->kernel, i);
    }
    if (w->segment_count > 0u) {
        struct coefficients_segment *before =
            (struct coefficients_segment *)(void *)(at + m->segment_size);
        before->next = (int16_t)-(int32_t)m->segment_size;
        segment->back = (int16_t)m->segment_size;
    }
    w->segment_count++;
    m->room -= m->segment_size;
}

/* Adds a piece or a segment: the kind whose records end earlier on the path. 0: there is no further one, or no room. */
static int add_next(struct making *m)
{
    const struct program_header *h = &m->program->header;
    const struct coefficients_window *w = m->out;
    const uint32_t piece = w->first_piece + w->piece_count;
    const uint32_t segment = w->first_segment + w->segment_count;
    const int64_t by_pieces_q40 =
        piece < h->piece_count ? program_piece_start(m->program, piece) : INT64_MAX;
    const int64_t by_segments_q40 =
        segment < h->segment_count ? program_segment_start(m->program, segment) : INT64_MAX;
    const int with_piece = by_pieces_q40 < by_segments_q40 || segment == h->segment_count;
    if (with_piece ? piece == h->piece_count || m->room < m->piece_size
                   : m->room < m->segment_size) {
        return 0;
    }
    if (with_piece) {
        add_piece(m);
    } else {
        add_segment(m);
    }
    return 1;
}

/* As many records from these numbers on as there is room for; of each kind at least COEFFICIENT_CACHE_LEAST, if the
 * program has so many. */
static void make_window(struct making *m)
{
    const struct program_header *h = &m->program->header;
    for (uint32_t i = 0; i < COEFFICIENT_CACHE_LEAST; i++) {
        if (m->out->first_piece + i < h->piece_count) {
            add_piece(m);
        }
        if (m->out->first_segment + i < h->segment_count) {
            add_segment(m);
        }
    }
    while (add_next(m)) {
    }
}

static struct making making_in(struct coefficient_half *half, uint32_t size,
                               const struct program *p, const struct kernel *kernel)
{
    const uint32_t segment_size = coefficients_segment_size(kernel, p->header.axis_count);
    half->program = p;
    half->window = (struct coefficients_window){.kernel = kernel,
                                                .pieces = half->memory,
                                                .segments = half->memory + size - segment_size,
                                                .segment_step = -(int32_t)segment_size};
    return (struct making){.program = p,
                           .out = &half->window,
                           .memory = half->memory,
                           .size = size,
                           .room = size,
                           .piece_size = coefficients_piece_size(kernel),
                           .segment_size = segment_size};
}

/* --- The two halves --- */

const struct coefficients_window *coefficient_cache_begin(struct coefficient_cache *cache,
                                                          const struct program *p,
                                                          const struct kernel *kernel)
{
    struct making m = making_in(&cache->half[0], cache->size, p, kernel);
    make_window(&m);
    cache->used = 0;
    cache->half[1].program = NULL;
    return &cache->half[0].window;
}

/* The piece of an arc length, as interpolator_search_step finds it. */
static uint32_t piece_of(const struct program *p, const struct feed_place *place)
{
    uint32_t piece = place->piece;
    while (place->by_arc != 0u && piece + 1u < p->header.piece_count &&
           program_piece_start(p, piece + 1u) <= place->arc_length_q40_mm) {
        piece++;
    }
    return piece;
}

static int is_all(const struct coefficients_window *w, const struct program *p)
{
    return w->first_piece + w->piece_count == p->header.piece_count &&
           w->first_segment + w->segment_count == p->header.segment_count;
}

/* A new window would have no further records: the present one begins there, or reaches the end of the program. */
static int has_all(const struct coefficients_window *w, const struct program *p, uint32_t piece,
                   uint32_t segment)
{
    const int inside = w->first_piece <= piece && piece - w->first_piece < w->piece_count &&
                       w->first_segment <= segment && segment - w->first_segment < w->segment_count;
    return (w->first_piece == piece && w->first_segment == segment) || (inside && is_all(w, p));
}

const struct coefficients_window *coefficient_cache_prepare(struct coefficient_cache *cache,
                                                            const struct program *p,
                                                            const struct feed_place *place)
{
    const struct coefficient_half *used = &cache->half[cache->used];
    const uint32_t piece = piece_of(p, place);
    /* a feed of nothing, rounded, goes back by less than one segment */
    const uint32_t segment = place->segment > 0u ? place->segment - 1u : 0u;
    if (used->program == p && has_all(&used->window, p, piece, segment)) {
        return NULL;
    }
    struct making m =
        making_in(&cache->half[1u - cache->used], cache->size, p, used->window.kernel);
    m.have = used->program == p ? &used->window : NULL;
    m.out->first_piece = piece;
    m.out->first_segment = segment;
    make_window(&m);
    return m.out;
}

void coefficient_cache_used(struct coefficient_cache *cache)
{
    cache->used = 1u - cache->used;
}
