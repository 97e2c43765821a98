/* SPDX-License-Identifier: MIT */
#include "core/rate_pace.h"

#include "core/qmath.h"

#define BOUND_MOST ((uint64_t)1 << 56)

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

void rate_bounds_of(struct rate_bounds *out, const struct program *p, uint32_t first,
                    uint32_t count)
{
    const uint32_t left = p->header.piece_count - first;
    const uint32_t behind = first + least(count, left);
    struct rate_bounds own;
    program_piece_override(p, first, &out->factor_q24, &out->rate_q16_per_s,
                           &out->second_q8_per_s2);
    for (uint32_t i = first + 1u; i < behind; i++) {
        program_piece_override(p, i, &own.factor_q24, &own.rate_q16_per_s, &own.second_q8_per_s2);
        out->factor_q24 = least(out->factor_q24, own.factor_q24);
        out->rate_q16_per_s = least(out->rate_q16_per_s, own.rate_q16_per_s);
        out->second_q8_per_s2 = least(out->second_q8_per_s2, own.second_q8_per_s2);
    }
}

/* bound times unit, rounded down; above `most` it is BOUND_MOST in any case, so no product passes 2^64. */
static uint64_t scaled(uint32_t bound, uint32_t most, uint64_t unit)
{
    const uint64_t a = least(bound, most) * unit;
    return a < BOUND_MOST ? a : BOUND_MOST;
}

/* At least a / b. */
static uint32_t quotient_above(uint64_t a, uint64_t b)
{
    return (uint32_t)qmath_div_u64(a, b) + 1u;
}

void rate_pace_make(struct rate_pace *out, const struct rate_bounds *bounds, uint32_t period_us)
{
    const uint32_t per_second = 1000000u / period_us;
    const uint32_t squared = per_second * per_second;
    const uint64_t slope = scaled(bounds->rate_q16_per_s, per_second << 16,
                                  qmath_div_u64((uint64_t)1 << 40, per_second));
    const uint64_t second =
        scaled(bounds->second_q8_per_s2, squared << 8, qmath_div_u64((uint64_t)1 << 48, squared));
    out->factor_q24 = bounds->factor_q24;
    out->turns = quotient_above(slope - 1u, second);
    out->inverse_slope = quotient_above((uint64_t)1 << 61, slope);
    out->inverse_root = quotient_above((uint64_t)1 << 45, qmath_root(second));
}
