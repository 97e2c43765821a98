/* SPDX-License-Identifier: MIT */
#include "core/rate_window.h"

#include "core/timebase.h"

static void look(struct rate_window *w, const struct timebase *tb, uint32_t last)
{
    rate_bounds_of(&w->own, tb->program, tb->piece, last + 1u - tb->piece);
    w->bounds = &w->own;
    w->end_q32_s = tb->piece_end_q42_s >> 10;
    for (uint32_t k = tb->piece + 1u; k <= last; k++) {
        w->end_q32_s += program_piece_duration(tb->program, k);
    }
}

void rate_window_get(struct rate_window *w, const struct timebase *tb, uint32_t window)
{
    const struct program *p = tb->program;
    const uint32_t behind = rate_window_pieces(window) - 1u;
    const uint32_t left = p->header.piece_count - 1u - tb->piece;
    const uint32_t last = tb->piece + (behind < left ? behind : left);
    if (tb->record != NULL) {
        w->bounds = &tb->record->ahead[window];
        w->end_q32_s = prepared_piece_at(p, p->prepared_for, last)->end_q32_s;
    } else {
        look(w, tb, last);
    }
    if (behind >= left) {
        w->end_q32_s = UINT64_MAX;
    }
}
