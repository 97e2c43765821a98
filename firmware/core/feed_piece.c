/* SPDX-License-Identifier: MIT */
/* Implements core/feed_piece.h (see there): arc length and feed of a feed piece at a time, in integers. Used by
 * firmware/core: the kernels fixed and float, and program_time. Writes only its arguments; feed_piece_set and
 * program_time in the main loop, otherwise in the tick. */
#include "core/feed_piece.h"

#include "core/qmath.h"

/* The derivative, as large as 32 bits hold all partial sums. */
static void set_slope(struct feed_piece *f)
{
    int64_t sum = 1;
    for (int k = 0; k < 7; k++) {
        sum += (k + 1) * qmath_magnitude(f->c_q44_mm[k]);
    }
    sum += sum >> 26; /* sums that are negative are rounded away from 0: 20 units of 2^31 at most */
    int bits = 64 - qmath_clz64((uint64_t)sum);
    f->slope_shift = bits > 32 ? bits - 31 : 1; /* at most 32: |c| <= 2^14 mm */
    for (int k = 0; k < 7; k++) {
        f->slope[k] = (int32_t)(((k + 1) * f->c_q44_mm[k]) >> f->slope_shift);
    }
    const int shift = f->slope_shift - 12 - f->exponent;
    f->feed_factor = shift < 0 ? 1 : shift < 31 ? (int32_t)1 << shift : INT32_MAX;
    f->feed_right_shift = shift >= 0 ? 0 : shift < -31 ? 31 : -shift;
}

void feed_piece_set(void *piece, const struct program_piece *from)
{
    struct feed_piece *f = piece;
    f->start_q40_mm = from->start_q40_mm;
    for (int k = 0; k < 7; k++) {
        f->c_q44_mm[k] = from->c_q40_mm[k] * 16;
    }
    f->exponent = program_piece_exponent(from->duration_q32_s);
    set_slope(f);
}

/* tau in q64, below 1. Its upper word drives the Horner steps; the remainder is below 2^-32, where
 * the slope suffices. */
static uint64_t scaled_time(uint64_t t_q42_s, int exponent)
{
    int shift = 22 - exponent;
    return shift >= 0 ? t_q42_s << shift : t_q42_s >> -shift;
}

void feed_piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s)
{
    const struct feed_piece *f = piece;
    uint64_t tau_q64 = scaled_time(t_q42_s, f->exponent);
    uint32_t tau = (uint32_t)(tau_q64 >> 32);
    int32_t tau_q31 = (int32_t)(tau >> 1);
    int32_t low_q63 = (int32_t)((uint32_t)tau_q64 >> 1);
    int64_t arc = f->c_q44_mm[6];
    int32_t slope = f->slope[6];
    for (int k = 5; k >= 0; k--) {
        arc = qmath_mul_unsigned(arc, tau) + f->c_q44_mm[k];
        slope = 2 * qmath_mul_hi(slope, tau_q31) + f->slope[k];
    }
    arc =
        qmath_mul_unsigned(arc, tau) + (2 * qmath_mul_hi(slope, low_q63) >> (32 - f->slope_shift));
    out->arc_length_q40_mm = f->start_q40_mm + qmath_round(arc, 4);
    out->feed_q32_mm_s = qmath_product(slope >> f->feed_right_shift, f->feed_factor);
}

/* The derivative of the slope, less three bits so that a coefficient times 6 fits. */
int64_t feed_piece_acceleration(const void *piece, uint64_t t_q42_s)
{
    const struct feed_piece *f = piece;
    const int32_t tau_q31 = (int32_t)(scaled_time(t_q42_s, f->exponent) >> 33);
    int32_t sum = 0;
    for (int k = 6; k > 0; k--) {
        sum = 2 * qmath_mul_hi(sum, tau_q31) + (int32_t)(qmath_product(f->slope[k], k) >> 3);
    }
    return qmath_shift_clamp(sum, f->slope_shift - 1 - 2 * f->exponent);
}
