/* SPDX-License-Identifier: MIT */
/*
 * feed_bounds and what it stands on, for every piece whose coefficients and duration are in range and for any bounds:
 * nothing overflows, every index and shift is in range, and the results are as piece_bounds.h says. Analysed by Eva in
 * `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * options: -eva-slevel 40
 * assumes: qmath_clz64 qmath_shift_clamp qmath_div_u64 bernstein_within
 * shows: feed_bounds_start feed_bounds_end feed_bounds_contained feed_bounds_within feed_bounds_parts
 * mutant: core/feed_bounds.c: a[k] >>= 4; => a[k] >>= 2;
 * mutant: core/feed_bounds.c: int shift = 32 - => int shift = 31 -
 * mutant: core/bernstein.c: k <= degree; k++ => k <= 8; k++
 * mutant: core/feed_bounds.c: apart > 0; apart /= 2 => apart > 0; apart -= 3
 * mutant: core/feed_bounds.c: qmath_lesser(above + 1, FEED_NO_BOUND_Q24) => above + 1
 */
#include "piece_bounds.h"
#include "proof.h"
#include "qmath_contracts.h"

/*@ requires 4 <= degree <= 7 && \initialized(b + (0 .. degree));
    assigns \result \from b[0 .. 7], low, high;
    ensures \result == 0 || \result == 1; */
int bernstein_within(const int64_t *b, int degree, int64_t low, int64_t high);

#include "core/bernstein.c"
#include "core/feed_bounds.c"
#include "core/program.c"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

static void state(const struct feed_state *s)
{
    prove(s->arc_length_q44_mm < POWER(62) && s->arc_length_q44_mm > -POWER(62));
    prove(s->feed_q24_mm_s < POWER(62) && s->feed_q24_mm_s > -POWER(62));
    prove(s->acceleration_q16_mm_s2 < POWER(62) && s->acceleration_q16_mm_s2 > -POWER(62));
}

/* Bounds of all eighths, limited as in the header. */
static void parts(const struct program_piece *c, enum feed_derivative derivative)
{
    int64_t low[FEED_PARTS];
    int64_t high[FEED_PARTS];
    feed_bounds_parts(c, derivative, low, high);
    for (int i = 0; i < FEED_PARTS; i++) {
        prove(low[i] >= -FEED_NO_BOUND_Q24 && low[i] < POWER(62));
        prove(high[i] >= -FEED_NO_BOUND_Q24 && high[i] <= FEED_NO_BOUND_Q24);
    }
}

int main(void)
{
    struct program_piece c;
    struct feed_state s;
    Frama_C_make_unknown((char *)&c, sizeof c);
    c.duration_q32_s = (uint64_t)any_between(1, POWER(54));
    for (int k = 0; k < 7; k++) {
        c.c_q40_mm[k] = any_between(-POWER(54), POWER(54));
    }
    feed_bounds_start(&c, &s);
    state(&s);
    feed_bounds_end(&c, &s);
    state(&s);
    int64_t low = any_between(INT64_MIN, INT64_MAX);
    int64_t high = any_between(INT64_MIN, INT64_MAX);
    feed_bounds_contained(&c);
    feed_bounds_within(&c, FEED_VELOCITY, low, high);
    feed_bounds_within(&c, FEED_ACCELERATION, low, high);
    feed_bounds_within(&c, FEED_JERK, low, high);
    parts(&c, FEED_VELOCITY);
    parts(&c, FEED_ACCELERATION);
    parts(&c, FEED_JERK);
    reached();
    return 0;
}
