/* SPDX-License-Identifier: MIT */
/* Implements core/program_clock.h (see there): which program time each tick has, and which feed piece that time is in.
 * Used by core/override_plan, which decides the override, and core/feed_override. Tick, if not stated otherwise.
 * Changes only its struct; no I/O. */
#include "core/program_clock.h"

uint64_t program_clock_step_q62_s(const struct program_clock *clock,
                                  const struct override_state *from, int64_t slope_q56)
{
    int64_t six_q56 = 3 * from->override_q57 + 2 * from->slope_q56 + slope_q56;
    int64_t step = qmath_mul_unsigned(six_q56, (uint32_t)(clock->sixth_q70_s >> 32)) +
                   (qmath_mul_unsigned(six_q56, (uint32_t)clock->sixth_q70_s) >> 32);
    return (uint64_t)(step > 0 ? step : 0);
}

static void set_period(struct program_clock *clock, uint32_t period_us)
{
    uint64_t period = (uint64_t)period_us << 36;
    clock->period_us = period_us;
    clock->period_log2 = (period_us >= 2000u ? 1u : 0u) + (period_us >= 4000u ? 1u : 0u) +
                         (period_us >= 8000u ? 1u : 0u);
    clock->period_q42_s = qmath_div_u64(period, PROGRAM_CLOCK_REMAINDER_UNIT);
    clock->period_remainder =
        (uint32_t)(period - clock->period_q42_s * PROGRAM_CLOCK_REMAINDER_UNIT);
    clock->period_q32_s = (uint32_t)qmath_q32_of_q42(clock->period_q42_s) + 1u;
    /* period_us 2^63 / 46875 in two steps */
    uint64_t high = qmath_div_u64((uint64_t)period_us << 48, 46875u);
    uint64_t left = ((uint64_t)period_us << 48) - high * 46875u;
    clock->sixth_q70_s = (high << 15) + qmath_div_u64(left << 15, 46875u);
}

static void set_time(struct program_clock *clock, uint64_t time_q42_s)
{
    clock->time_q42_s = time_q42_s;
    clock->remainder = 0;
    clock->fine = 0;
    clock->even_q62_s = 0;
}

void program_clock_begin_at_piece(struct program_clock *clock, const struct program *p,
                                  uint32_t period_us, const struct coefficients_piece *first)
{
    clock->program = p;
    clock->duration_q42_s = qmath_q42_of_q32(p->header.duration_q32_s);
    set_time(clock, 0);
    set_period(clock, period_us);
    clock->piece = 0;
    clock->record = first;
}

void program_clock_begin(struct program_clock *clock, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s)
{
    program_clock_begin_at_piece(clock, p, period_us,
                                 coefficients_piece_at(p, p->coefficients_for, 0));
    set_time(clock, time_q42_s < clock->duration_q42_s ? time_q42_s : clock->duration_q42_s);
    if (clock->time_q42_s != clock->duration_q42_s &&
        clock->time_q42_s >= clock->record->end_q42_s) {
        program_clock_find_piece(clock, clock->time_q42_s, UINT32_MAX);
    }
}

void program_clock_set(struct program_clock *clock, uint64_t time_q42_s, uint32_t piece,
                       const struct coefficients_piece *record)
{
    set_time(clock, time_q42_s);
    clock->piece = piece;
    clock->record = record;
}

void program_clock_carry(struct program_clock *clock, const struct program *p, uint64_t shift_q42_s,
                         uint32_t piece, const struct coefficients_piece *record)
{
    clock->program = p;
    clock->duration_q42_s = qmath_q42_of_q32(p->header.duration_q32_s);
    clock->time_q42_s -= shift_q42_s;
    clock->piece = piece;
    clock->record = record;
}
