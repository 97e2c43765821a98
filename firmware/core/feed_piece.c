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

/* tau in q64, below 1. Its upper word drives the Horner steps; what is left is below 2^-32, where
 * the slope suffices. */
static uint64_t scaled_time(uint64_t t_q42_s, int exponent)
{
    int shift = 22 - exponent;
    return shift >= 0 ? t_q42_s << shift : t_q42_s >> -shift;
}

void feed_piece_at(const struct feed_piece *f, uint64_t t_q42_s, struct feed_point *out)
{
    uint64_t tau_q64 = scaled_time(t_q42_s, f->exponent);
    uint32_t tau = (uint32_t)(tau_q64 >> 32);
    int64_t arc = f->c_q44_mm[6];
    int64_t slope = arc;
    for (int k = 5; k >= 0; k--) {
        arc = qmath_mul_unsigned(arc, tau) + f->c_q44_mm[k];
        slope = qmath_mul_unsigned(slope, tau) + arc;
    }
    arc = qmath_mul_unsigned(arc, tau) + (qmath_mul_unsigned(slope, (uint32_t)tau_q64) >> 32);
    out->arc_length_q40_mm = f->start_q40_mm + qmath_round(arc, 4);
    out->feed_q32_mm_s = qmath_shift_clamp(slope, -12 - f->exponent);
}

void feed_piece_make(void *piece, const struct program_piece *from)
{
    feed_piece_set(piece, from);
}

void feed_piece_point(const void *piece, uint64_t t_q42_s, struct feed_point *out)
{
    feed_piece_at(piece, t_q42_s, out);
}
