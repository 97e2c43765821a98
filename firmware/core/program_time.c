/* SPDX-License-Identifier: MIT */
/* Implements core/program_time.h (see there): the program time at which a program reaches an arc length. Used by
 * app/machine/motion. Pure, main loop. */
#include "core/program_time.h"

#include "core/feed_piece.h"
#include "core/qmath.h"

/* Least t in [0, duration] with F(t) >= arc length; F rises (within rounding: docs/reference/protocol.md 1.3).
 */
static uint64_t bisect(const struct program_piece *piece, int64_t arc_length_q40_mm)
{
    struct feed_piece feed;
    struct feed_point at;
    uint64_t low = 0;
    uint64_t high = qmath_q42_of_q32(piece->duration_q32_s);
    feed_piece_set(&feed, piece);
    while (low < high) {
        uint64_t middle = low + (high - low) / 2u;
        feed_piece_at(&feed, &at, middle);
        if (at.arc_length_q40_mm >= arc_length_q40_mm) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

uint64_t program_time_at_q42(const struct program *p, int64_t arc_length_q40_mm)
{
    struct program_piece piece;
    struct program_piece next;
    uint64_t start_q32_s = 0;
    if (arc_length_q40_mm <= 0) {
        return 0;
    }
    if (arc_length_q40_mm >= p->header.length_q40_mm) {
        return qmath_q42_of_q32(p->header.duration_q32_s);
    }
    program_piece_get(p, 0, &piece);
    for (uint32_t i = 1; i < p->header.piece_count; i++) {
        program_piece_get(p, i, &next);
        if (next.start_q40_mm >= arc_length_q40_mm) {
            break;
        }
        start_q32_s += piece.duration_q32_s;
        piece = next;
    }
    return qmath_q42_of_q32(start_q32_s) + bisect(&piece, arc_length_q40_mm);
}
