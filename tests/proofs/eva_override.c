/* SPDX-License-Identifier: MIT */
/*
 * The feed override, for a program of three pieces: every command, a tick and every question, from any phase and state,
 * whatever the plan of the override, the brake and the interpolator give in their ranges: nothing overflows, no
 * conversion to a signed type changes a number, no division by 0, no entry of the stop table beyond the last is read,
 * and what stands in a field of few values stays one of them. Analysed by Eva in `make proofs` (tools/analysis/prove.py
 * explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 60 -warn-signed-downcast
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/qmath.h: int32_t low = (int32_t)((uint32_t)a >> 1); => int32_t low = (int32_t)any_between(0, INT32_MAX);
 * instead: core/feed_override.c: qmath_magnitude(feed) >= MOST_FEED_Q32 => feed >= MOST_FEED_Q32 || feed <= -MOST_FEED_Q32
 * assumes: qmath_div_u64 qmath_shift_clamp program_clock_set override_plan_begin override_plan_restart override_plan_hold override_plan_release override_plan_set override_plan_end_rise override_plan_tick path_brake_numbers_of path_brake_begin path_brake_fits path_brake_first path_brake_step path_brake_ended interpolator_at_piece interpolator_at_arc_length interpolator_acceleration_q40 interpolator_search_begin interpolator_search_step
 * mutant: core/feed_override.c: ((int64_t)1 << 45) => ((int64_t)1 << 49)
 * mutant: core/feed_override.c: program_stop_get(f->clock.program, f->clock.piece, (enum => program_stop_get(f->clock.program, f->clock.piece + 1u, (enum
 * mutant: core/feed_override.c: slope_q56 >> 26 => slope_q56 >> 25
 * mutant: core/feed_override.c: SPARE_TICKS * TICK_Q30 => INT64_MAX
 * mutant: core/feed_override.c: f->kind : NO_NUMBERS; => f->kind : NO_NUMBERS + 1u;
 * mutant: core/feed_override.c: f->place.piece_index, f->place.piece => f->place.piece_index + 1u, f->place.piece
 * mutant: core/feed_override.c: interpolator_search_begin(&f->place, f->clock.piece, => interpolator_search_begin(&f->place, f->clock.piece + 1u,
 */
#include "override_contracts.h"
#include "proof.h"
#include "qmath_contracts.h"

#include "core/feed_override.c"
#include "core/program.c"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

#define COUNT 3u

static struct coefficients_piece record;

/* As eva_clock.c shows: in range, wherever it begins. */
void program_clock_begin(struct program_clock *clock, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s)
{
    Frama_C_make_unknown((char *)&clock->duration_q42_s, sizeof clock->duration_q42_s);
    clock->program = p;
    clock->period_us = period_us;
    clock->period_log2 = (uint32_t)any_between(0, 3);
    clock->time_q42_s = time_q42_s;
    clock->remainder = (uint32_t)any_between(0, PROGRAM_CLOCK_REMAINDER_UNIT - 1);
    clock->fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
    clock->piece = (uint32_t)any_between(0, COUNT - 1);
    clock->record = &record;
}

static struct path_state any_at(void)
{
    const struct path_state at = {any_between(LEAST_ARC, MOST_ARC), (uint32_t)any_between(0, 65535),
                                  any_between(0, BRAKE_MOST_RISING),
                                  any_between(-BRAKE_MOST_RISING, BRAKE_MOST_RISING)};
    return at;
}

static struct path_brake_numbers any_numbers(void)
{
    const struct path_brake_numbers n = {any_between(BRAKE_LEAST, BRAKE_MOST),
                                         any_between(BRAKE_LEAST, BRAKE_MOST),
                                         any_between(BRAKE_LEAST, BRAKE_MOST)};
    return n;
}

/* Wherever it is between two ticks. */
static void place(struct feed_override *f)
{
    f->plan.now.override_q57 = any_between(0, OVERRIDE_MOST);
    f->plan.now.slope_q56 = any_between(-MOST_SLOPE, MOST_SLOPE);
    f->plan.started = (uint32_t)any_between(0, 1);
    f->plan.saturated = (uint32_t)any_between(0, 1);
    f->clock.piece = (uint32_t)any_between(0, COUNT - 1);
    f->clock.remainder = (uint32_t)any_between(0, PROGRAM_CLOCK_REMAINDER_UNIT - 1);
    f->clock.fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
    f->brake.at = any_at();
    f->brake.numbers = any_numbers();
    f->brake.phase = (uint32_t)any_between(0, 3);
    f->numbers = any_numbers();
    f->numbers_piece = (uint32_t)any_between(0, UINT32_MAX);
    f->numbers_kind = (uint32_t)any_between(0, 2);
    f->place.piece = &record;
    f->place.piece_index = (uint32_t)any_between(0, COUNT - 1);
    f->place.time_q42_s = (uint64_t)any_between(INT64_MIN, INT64_MAX);
    f->point.arc_length_q40_mm = any_between(LEAST_ARC, MOST_ARC);
    f->point.feed_q32_mm_s = any_between(-MOST_FEED_AT, MOST_FEED_AT);
    f->state = (uint32_t)any_between(0, 6);
    f->at_end = (uint32_t)any_between(0, 6);
    f->goes_on = (uint32_t)any_between(0, 1);
    f->phase = (uint32_t)any_between(0, 2);
    f->kind = (uint32_t)any_between(0, 1);
    f->replace = (uint32_t)any_between(0, 1);
    f->found = (uint32_t)any_between(0, 1);
    f->left_q30 = any_between(-POWER(62), POWER(62));
}

static void stays(const struct feed_override *f)
{
    prove(f->numbers_kind <= 2 && f->state <= 6 && f->phase <= 2 && f->kind <= 1);
    prove(f->at_end <= 6 && f->goes_on <= 1);
    prove(f->replace <= 1 && f->found <= 1 && f->clock.piece < COUNT);
}

static void command(struct feed_override *f)
{
    place(f);
    feed_override_hold(f);
    stays(f);
    place(f);
    feed_override_resume(f);
    stays(f);
    place(f);
    feed_override_set(f, (uint32_t)any_between(0, UINT32_MAX));
    stays(f);
    place(f);
    feed_override_stop(f);
    stays(f);
    place(f);
    feed_override_fault_stop(f);
    stays(f);
}

static void ask_all(struct feed_override *f)
{
    place(f);
    feed_override_state(f);
    feed_override_late(f);
    feed_override_time_q42(f);
    feed_override_bound_us(f, PROGRAM_STOP_HOLD);
    feed_override_bound_us(f, PROGRAM_STOP_FAULT);
    feed_override_feed_q32(f);
    feed_override_actual_q30(f);
    feed_override_saturated(f);
    feed_override_waits(f);
}

static void tick(struct feed_override *f, struct interpolator *it)
{
    struct interpolator_point out = {0}; /* unchanged where the tick fails */
    place(f);
    if (feed_override_next(f, it, &out) == 0) {
        prove(IS_ARC(out.arc_length_q40_mm));
    }
    stays(f);
}

int main(void)
{
    static uint8_t image[PROGRAM_HEADER_SIZE + COUNT * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE)];
    static struct program p;
    static struct feed_override f;
    static struct interpolator it;
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    Frama_C_make_unknown((char *)&record, sizeof record);
    p.image = image;
    p.size = sizeof image;
    p.header.header_size = PROGRAM_HEADER_SIZE;
    p.header.axis_count = (uint16_t)any_between(PROGRAM_PLANE, PROGRAM_AXES);
    p.header.segment_count = 0;
    p.header.piece_count = COUNT;
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    feed_override_begin(&f, &p, (uint32_t)1000 << any_between(0, 3), (uint64_t)any_between(INT64_MIN, INT64_MAX));
    stays(&f);
    command(&f);
    ask_all(&f);
    tick(&f, &it);
    reached();
    return 0;
}
