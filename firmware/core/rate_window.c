/* SPDX-License-Identifier: MIT */
#include "core/rate_window.h"

#include "core/prepared.h"
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

static void set_bounds(struct rate_bounds *out, const struct rate_scale *scale,
                       const struct prepared_bounds *own)
{
    out->most_q57 = (int64_t)own->factor_q24 << 33;
    out->slope_q56 = scaled(own->rate_q16_per_s, scale->most_rate_q16, scale->slope);
    out->second_q56 = scaled(own->second_q8_per_s2, scale->most_second_q8, scale->second);
}

void rate_window_piece(const struct rate_scale *scale, const struct program *p, uint32_t i,
                       struct rate_bounds *out)
{
    struct prepared_bounds own;
    program_piece_override(p, i, &own.factor_q24, &own.rate_q16_per_s, &own.second_q8_per_s2);
    set_bounds(out, scale, &own);
}

static void look(struct rate_window *w, const struct rate_scale *scale, const struct program *p,
                 uint32_t i, uint32_t last)
{
    struct rate_bounds bounds;
    rate_window_piece(scale, p, i, &w->bounds);
    for (uint32_t k = i + 1u; k <= last; k++) {
        rate_window_piece(scale, p, k, &bounds);
        w->bounds = rate_bounds_least(&w->bounds, &bounds);
        w->end_q32_s += program_piece_duration(p, k);
    }
}

void rate_window_get(struct rate_window *w, const struct rate_scale *scale, const struct program *p,
                     uint32_t i, uint64_t end_q32_s, uint32_t level)
{
    const uint32_t behind = (1u << level) - 1u;
    const uint32_t left = p->header.piece_count - 1u - i;
    const uint32_t last = i + (behind < left ? behind : left);
    w->end_q32_s = end_q32_s;
    if (p->prepared_for != NULL) {
        set_bounds(&w->bounds, scale, &prepared_piece_at(p, p->prepared_for, i)->ahead[level]);
        w->end_q32_s = prepared_piece_at(p, p->prepared_for, last)->end_q32_s;
    } else {
        look(w, scale, p, i, last);
    }
    if (behind >= left) {
        w->end_q32_s = UINT64_MAX;
    }
}
