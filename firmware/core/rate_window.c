/* SPDX-License-Identifier: MIT */
#include "core/rate_window.h"

#include "core/qmath.h"

/* slope: rate_q16 h 2^40, second: second_q8 h^2 2^48. With the clamp products stay at 2^56. */
void rate_scale_set(struct rate_scale *scale, uint32_t period_us)
{
    uint32_t per_second = 1000000u / period_us;
    scale->slope = qmath_div_u64((uint64_t)1 << 40, per_second);
    scale->second = qmath_div_u64(((uint64_t)1 << 48), per_second * per_second);
    scale->most_rate_q16 = per_second << 16;
    scale->most_second_q8 = per_second * per_second << 8;
}

static int64_t scaled(uint32_t bound, uint32_t most, uint64_t scale)
{
    int64_t a = (int64_t)((bound < most ? bound : most) * scale);
    return a > RATE_SLOPE_MOST ? RATE_SLOPE_MOST : a;
}

void rate_window_piece(const struct rate_scale *scale, const struct program *p, uint32_t i,
                       struct rate_bounds *out)
{
    uint32_t factor_q24;
    uint32_t rate_q16;
    uint32_t second_q8;
    program_piece_override(p, i, &factor_q24, &rate_q16, &second_q8);
    out->most_q57 = (int64_t)factor_q24 << 33;
    out->slope_q56 = scaled(rate_q16, scale->most_rate_q16, scale->slope);
    out->second_q56 = scaled(second_q8, scale->most_second_q8, scale->second);
}

static void set_end(struct rate_window *w, uint64_t end_q32_s)
{
    w->end_q32_s = w->next == w->program->header.piece_count ? UINT64_MAX : end_q32_s;
}

void rate_window_open(struct rate_window *w, const struct program *p,
                      const struct rate_scale *scale, uint32_t piece, uint64_t end_q32_s,
                      const struct rate_bounds *bounds)
{
    w->program = p;
    w->scale = scale;
    w->bounds = *bounds;
    w->next = piece + 1u;
    w->pieces = 1;
    set_end(w, end_q32_s);
}

int rate_window_extend(struct rate_window *w)
{
    struct rate_bounds bounds;
    if (w->pieces == RATE_WINDOW_PIECES || w->next == w->program->header.piece_count) {
        return 0;
    }
    rate_window_piece(w->scale, w->program, w->next, &bounds);
    w->bounds = rate_bounds_least(&w->bounds, &bounds);
    uint64_t duration = program_piece_duration(w->program, w->next);
    w->next++;
    w->pieces++;
    set_end(w, w->end_q32_s + duration);
    return 1;
}
