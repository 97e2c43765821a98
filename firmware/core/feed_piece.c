/* SPDX-License-Identifier: MIT */
#include "core/feed_piece.h"

#include "core/qmath.h"

void feed_piece_set(struct feed_piece *f, const struct program_piece *piece)
{
    f->start_q40_mm = piece->start_q40_mm;
    for (int k = 0; k < 7; k++) {
        f->c_q44_mm[k] = piece->c_q40_mm[k] * 16;
    }
    f->exponent = program_piece_exponent(piece->duration_q32_s);
}

/* What the shift drops of tau in a piece longer than 1 s, in 2^-64: below 2^-32 of tau, so the slope
 * suffices. */
static int64_t rest_of_tau(int64_t slope_q44, uint64_t t_q32_s, int exponent)
{
    uint32_t rest = (uint32_t)(t_q32_s << (32 - exponent));
    return qmath_mul_unsigned(slope_q44, rest) >> 32;
}

void feed_piece_at(const struct feed_piece *f, uint64_t t_q32_s, struct feed_point *out)
{
    int e = f->exponent;
    uint32_t tau = (uint32_t)(e > 0 ? t_q32_s >> e : t_q32_s << -e);
    int64_t arc = f->c_q44_mm[6];
    int64_t slope = arc;
    for (int k = 5; k >= 0; k--) {
        arc = qmath_mul_unsigned(arc, tau) + f->c_q44_mm[k];
        slope = qmath_mul_unsigned(slope, tau) + arc;
    }
    arc = qmath_mul_unsigned(arc, tau);
    if (e > 0) {
        arc += rest_of_tau(slope, t_q32_s, e);
    }
    out->arc_length_q40_mm = f->start_q40_mm + qmath_round(arc, 4);
    out->feed_q32_mm_s = qmath_shift(slope, -12 - e);
}
