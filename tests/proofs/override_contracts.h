/* SPDX-License-Identifier: MIT */
/*
 * What a tick of the feed override takes for granted of the program clock, the plan of the override, the brake and the
 * interpolator; for eva_override.c (docs/theory/proofs.md sections 15.5 and 15.6). Included by eva_override.c; never
 * executed, touches nothing.
 */
#ifndef HODOGRAPH_OVERRIDE_CONTRACTS_H
#define HODOGRAPH_OVERRIDE_CONTRACTS_H

#include "proof.h"

#include "brake_contracts.h"
#include "core/feed_override.h"
#include "ramp_contracts.h"

#define MOST_SLOPE       ((int64_t)1 << 57)
#define MOST_ARC         (((int64_t)1 << 62) + ((int64_t)1 << 60)) /* length and a piece's coefficients */
#define MOST_FEED_AT     ((int64_t)1 << 60)
#define LEAST_ARC        (-((int64_t)1 << 60))
#define IS_ARC(q40_mm)   (LEAST_ARC <= (q40_mm) && (q40_mm) <= MOST_ARC)
#define IS_SPEED(q56)    (0 <= (q56) && (q56) <= BRAKE_MOST_RISING)
#define IS_RESULT(value) (-3 <= (value) && (value) <= 1)

/* clang-format off */
/*@ predicate is_clock(struct program_clock *clock) = clock->piece < clock->program->header.piece_count;
    predicate is_plan(struct override_plan *plan) =
      IS_OVERRIDE(plan->now.override_q57) && -MOST_SLOPE <= plan->now.slope_q56 <= MOST_SLOPE;
    predicate is_point(struct interpolator_point *point) =
      IS_ARC(point->arc_length_q40_mm) && -MOST_FEED_AT <= point->feed_q32_mm_s <= MOST_FEED_AT;
    predicate is_at(struct path_state *at) = IS_ARC(at->arc_length_q40_mm) && at->fine_q56_mm < 65536;
    predicate is_brake(struct path_brake *brake) = is_at(&brake->at) && IS_SPEED(brake->at.speed_q56);
*/
/* clang-format on */

/* --- core/program_clock.h, core/override_plan.h: eva_clock.c --- */

/*@ requires piece < clock->program->header.piece_count;
    assigns clock->time_q42_s, clock->remainder, clock->fine, clock->piece, clock->even_q62_s \from time_q42_s, piece;
    ensures is_clock(clock); */
void program_clock_set(struct program_clock *clock, uint64_t time_q42_s, uint32_t piece,
                       const struct coefficients_piece *record);

/*@ assigns *plan \from \nothing;
    ensures \initialized(plan) && plan->now.override_q57 == 0 && plan->now.slope_q56 == 0; */
void override_plan_begin(struct override_plan *plan, const struct program *p);

/*@ requires is_plan(plan);
    assigns *plan \from *plan;
    ensures \initialized(plan) && plan->now.override_q57 == 0 && plan->now.slope_q56 == 0; */
void override_plan_restart(struct override_plan *plan);

/*@ requires is_plan(plan);
    assigns plan->held, plan->steady \from \nothing; */
void override_plan_hold(struct override_plan *plan);

/*@ requires is_plan(plan);
    assigns plan->held, plan->steady \from \nothing; */
void override_plan_release(struct override_plan *plan);

/*@ requires is_plan(plan);
    assigns plan->commanded_q57, plan->steady \from percent; */
void override_plan_set(struct override_plan *plan, uint32_t percent);

/*@ requires is_plan(plan);
    assigns plan->ramp \from plan->ramp; */
void override_plan_end_rise(struct override_plan *plan);

/*@ requires is_plan(plan) && is_clock(clock);
    assigns \result, *plan, clock->time_q42_s, clock->remainder, clock->fine, clock->piece, clock->even_q62_s
            \from *plan, clock->time_q42_s;
    ensures \initialized(plan) && is_plan(plan) && is_clock(clock); */
uint64_t override_plan_tick(struct override_plan *plan, struct program_clock *clock);

/* --- core/path_brake.h: eva_brake.c, cbmc_brake.c --- */

/*@ requires IS_PERIOD(period_us) && \initialized(&stop->jerk_down) && \initialized(&stop->jerk_up);
    assigns \result, *out \from period_us;
    ensures \result == 0 || \result == 1;
    ensures \initialized(out) && IS_NUMBERS(out); */
int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us);

/*@ requires is_at(from) && IS_NUMBERS(numbers);
    assigns \result, *brake \from *from;
    ensures \result == 0 || \result == 1;
    ensures \initialized(brake) && is_brake(brake); */
int path_brake_begin(struct path_brake *brake, const struct path_state *from,
                     const struct path_brake_numbers *numbers);

/*@ requires is_at(from) && IS_NUMBERS(numbers);
    requires -2 * MOST_ARC <= distance_q40_mm <= 2 * MOST_ARC;
    assigns \result \from distance_q40_mm;
    ensures \result == 0 || \result == 1; */
int path_brake_fits(const struct path_state *from, const struct path_brake_numbers *numbers,
                    int64_t distance_q40_mm);

/*@ requires is_brake(brake);
    assigns *brake \from brake->at.speed_q56;
    ensures \initialized(brake) && is_brake(brake); */
void path_brake_first(struct path_brake *brake);

/*@ requires is_brake(brake);
    assigns *brake \from brake->at.speed_q56;
    ensures \initialized(brake) && is_brake(brake); */
void path_brake_step(struct path_brake *brake);

/*@ assigns \result \from brake->phase;
    ensures \result == 0 || \result == 1; */
int path_brake_ended(const struct path_brake *brake);

/* --- core/interpolator.h: eva_interpolator.c --- */

/*@ assigns \result, *out, it->segment \from time_q42_s;
    ensures IS_RESULT(\result) && \initialized(out) && is_point(out); */
int interpolator_at_piece(struct interpolator *it, const struct coefficients_piece *piece, uint64_t time_q42_s,
                    struct interpolator_point *out);

/*@ assigns \result, *out, it->segment \from arc_length_q40_mm;
    ensures IS_RESULT(\result) && \initialized(out) && is_point(out); */
int interpolator_at_arc_length(struct interpolator *it, int64_t arc_length_q40_mm, struct interpolator_point *out);

/*@ assigns \result \from time_q42_s; */
int64_t interpolator_acceleration_q40(const struct interpolator *it, const struct coefficients_piece *piece,
                                uint64_t time_q42_s);

/*@ requires index < 3;
    assigns search->arc_length_q40_mm, search->time_q42_s, search->piece_index, search->bisecting \from index,
            arc_length_q40_mm;
    ensures search->piece_index < 3; */
void interpolator_search_begin(struct interpolator_search *search, uint32_t index,
                               int64_t arc_length_q40_mm);

/*@ requires search->piece_index < 3;
    assigns \result, search->time_q42_s, search->piece_index, search->bisecting, search->low_q42_s, search->high_q42_s
            \from search->piece_index;
    ensures search->piece_index < 3; */
int interpolator_search_step(const struct interpolator *it, struct interpolator_search *search);

#endif
