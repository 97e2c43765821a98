/* SPDX-License-Identifier: MIT */
/*
 * What the parts of the feed override promise each other: docs/theory/numerics.md section 12, "Feed override", and
 * docs/theory/proofs.md 15.4. Each contract stands here once, for the proof that shows it and for those that assume it
 * (section 15.5). Included by proofs of this folder; never executed, touches nothing.
 */
#ifndef HODOGRAPH_RAMP_CONTRACTS_H
#define HODOGRAPH_RAMP_CONTRACTS_H

#include "core/override_ramp.h"

#define MOST_HALF ((uint32_t)1 << 28) /* ticks of half a ramp: 2^27 and 1 for the slowest bounds */
#define MOST_SPAN ((uint64_t)1 << 57)

#define IS_PERIOD(us) ((us) == 1000 || (us) == 2000 || (us) == 4000 || (us) == 8000)
#define IS_FACTOR(f)  (0x4000 <= (f) && (f) <= 0x8000) /* q14 */
#define IS_OVERRIDE(q57)  (0 <= (q57) && (q57) <= OVERRIDE_MOST)
#define IS_TICKS(t)   (1 <= (t)->rise && (t)->rise <= (t)->half && (t)->half <= MOST_HALF)
#define IS_LIMITS(p)                                                                                 \
    ((p)->rate_ticks >= 1 && (p)->inverse_slope <= 0x80000001 && (p)->inverse_root <= 0x80040000)
#define IS_CHANGE(c)                                                                                 \
    (IS_OVERRIDE((c)->from_q57) && IS_OVERRIDE((c)->to_q57) && (c)->first < PROGRAM_LEVELS &&        \
     (c)->last < PROGRAM_LEVELS)
#define IS_STAGE(s) (IS_OVERRIDE((s)->end_q57) && (s)->level < PROGRAM_LEVELS)

#if defined(__FRAMAC__)

/*@ requires i < p->header.piece_count;
    assigns *out \from i;
    ensures \initialized(out) && IS_FACTOR(out->factor_q14); */
void program_piece_override(const struct program *p, uint32_t i, struct program_override *out);

/*@ requires first < p->header.piece_count && count > 0;
    assigns *out \from first, count;
    ensures \initialized(out) && IS_FACTOR(out->factor_q14); */
void override_bounds_of(struct program_override *out, const struct program *p, uint32_t first,
                    uint32_t count);

/*@ requires \initialized(bounds) && level < PROGRAM_LEVELS && period_log2 <= 3;
    assigns *out \from *bounds, level, period_log2;
    ensures \initialized(out) && IS_LIMITS(out); */
void override_limits_of(struct ramp_limits *out, const struct program_override *bounds, uint32_t level,
                  uint32_t period_log2);

/* Of this and the next, cbmc_ticks.c shows what compares two numbers: rise <= half, twice a step <= the change. */
/*@ requires \initialized(limits) && IS_LIMITS(limits) && IS_OVERRIDE(change_q57);
    assigns *ticks \from *limits, change_q57;
    ensures \initialized(ticks) && 1 <= ticks->rise && 1 <= ticks->half <= MOST_HALF; */
void override_ticks_of(struct ramp_ticks *ticks, const struct ramp_limits *limits, int64_t change_q57);

/*@ requires 1 <= ticks->rise <= MOST_HALF && 1 <= ticks->half <= MOST_HALF && IS_OVERRIDE(change_q57);
    assigns \result \from *ticks, change_q57;
    ensures 0 <= \result <= OVERRIDE_ONE; */
int64_t override_step_of(const struct ramp_ticks *ticks, int64_t change_q57);

/*@ requires 1 <= ticks->rise <= MOST_HALF && 1 <= ticks->half <= MOST_HALF;
    requires IS_OVERRIDE(mean_q57) && 0 < period_q32_s <= (1 << 26);
    assigns \result \from *ticks, mean_q57, period_q32_s;
    ensures \result <= MOST_SPAN; */
uint64_t override_span_q32(const struct ramp_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s);

#endif

#endif
