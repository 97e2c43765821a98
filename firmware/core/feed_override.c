/* SPDX-License-Identifier: MIT */
/* Implements core/feed_override.h (see there): the feed override and path stops: which place of the path each tick has.
 * Called by firmware/app, sim/offline and host tools. Tick, or main loop while no tick runs, as each function states.
 * Changes only its struct and the interpolator that it is given; no I/O. */
#include "core/feed_override.h"

#include <stddef.h>
#include <string.h>

#include "core/qmath.h"

enum phase { PHASE_PLAN, PHASE_BRAKE, PHASE_REST };

/* A state that feed_override_state reports as FEED_RUNNING: rest at the end of a tail. */
#define STATE_WAITING ((uint32_t)FEED_HELD + 1u)

#define TICK_Q30          ((int64_t)1 << 30)
#define SPARE_TICKS       2        /* of the deadline: rounding */
#define FIFTH_MORE_MS_Q32 5153961u /* 6/5 of a microsecond in ms, rounded up */
#define END_TICKS         2u       /* until a command counts, and until the end is a setpoint */
#define SEARCH_STEPS      2        /* in a tick at standstill */
#define NO_NUMBERS        2u       /* no enum program_stop_kind: no path stop is possible */
#define MOST_FEED_Q32     ((int64_t)1 << 45) /* 2^13 mm/s */
/* 2^57, the greatest, less a unit: it is made an int32_t */
#define MOST_SLOPE_Q56 (((int64_t)1 << 57) - 1)
#define REACH_Q40      ((int64_t)1 << 26) /* 2^-14 mm: how far a piece may reach beyond its ends */
#define MS_Q40         1099511628u        /* 2^40 / 1000 */
#define UM_PER_MM      1000u
#define US_PER_S       1000000u

/* The clock has been set. */
static void begin(struct feed_override *f, const struct program *p)
{
    override_plan_begin(&f->plan, p);
    f->phase = PHASE_PLAN;
    f->state = f->clock.time_q42_s == f->clock.duration_q42_s ? FEED_ENDED : FEED_RUNNING;
    f->at_end = FEED_ENDED;
}

void feed_override_begin(struct feed_override *f, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s)
{
    memset(f, 0, sizeof *f);
    program_clock_begin(&f->clock, p, period_us, time_q42_s);
    begin(f, p);
}

/* What each state becomes at the end of a tail. */
static uint32_t state_at_tail_end(uint32_t state)
{
    if (state == FEED_RUNNING || state == STATE_WAITING) {
        return STATE_WAITING;
    }
    return state == FEED_HOLDING || state == FEED_HELD ? FEED_HELD : FEED_STOPPED;
}

/* The state at the end of the program is set beforehand, so that the last tick takes no more time. */
static void set_state(struct feed_override *f, uint32_t state)
{
    f->state = state;
    f->at_end = f->goes_on != 0u ? state_at_tail_end(state) : FEED_ENDED;
}

static void goes_on(struct feed_override *f, const struct chunk *chunk)
{
    f->goes_on = chunk_goes_on(chunk) ? 1u : 0u;
    override_plan_limit(&f->plan, f->goes_on != 0u ? OVERRIDE_ONE : OVERRIDE_MOST);
    set_state(f, f->state);
}

void feed_override_begin_job(struct feed_override *f, const struct chunk *first,
                             const struct coefficients_window *window, uint32_t period_us)
{
    memset(f, 0, sizeof *f);
    program_clock_begin_at_piece(&f->clock, &first->program, period_us,
                                 coefficients_window_piece(window, 0));
    begin(f, &first->program);
    goes_on(f, first);
}

/* --- Commands --- */

/* At the end of a tail the nominal motion is still the source of setpoints, and stays at its end. */
int feed_override_waits(const struct feed_override *f)
{
    return f->phase == PHASE_PLAN && (f->state == STATE_WAITING || f->state == FEED_HELD);
}

static int rests(const struct feed_override *f)
{
    return f->phase == PHASE_REST || feed_override_waits(f);
}

static int comes_to_standstill(const struct feed_override *f)
{
    return f->state == FEED_HOLDING || f->state == FEED_STOPPING;
}

/* Time left of the program at override 1, us; held at 4 s. */
static uint32_t left_us(const struct feed_override *f)
{
    const uint64_t left_q42 = f->clock.duration_q42_s - f->clock.time_q42_s;
    return left_q42 >> 44 != 0 ? 4000000u : (uint32_t)((left_q42 >> 12) * 15625u >> 24);
}

/* The bound and a fifth, as ticks. */
static int64_t deadline_q30(const struct feed_override *f)
{
    const uint32_t bound_us = feed_override_bound_us(f, (enum program_stop_kind)f->kind);
    const uint64_t ms_q32 = qmath_product_unsigned(bound_us, FIFTH_MORE_MS_Q32);
    return ((int64_t)(ms_q32 >> (2u + f->clock.period_log2))) + SPARE_TICKS * TICK_Q30;
}

static void read_numbers(struct feed_override *f)
{
    struct program_stop stop;
    program_stop_get(f->clock.program, f->clock.piece, (enum program_stop_kind)f->kind, &stop);
    f->numbers_piece = f->clock.piece;
    f->numbers_kind =
        path_brake_numbers_of(&f->numbers, &stop, f->clock.period_us) ? f->kind : NO_NUMBERS;
}

/* The stop deadline of a path stop under way stays. */
static void request_stop(struct feed_override *f, enum program_stop_kind kind)
{
    const int64_t left_q30 = f->phase == PHASE_BRAKE ? f->left_q30 : 0;
    f->kind = (uint32_t)kind;
    f->left_q30 = qmath_greater(deadline_q30(f), left_q30);
    read_numbers(f);
}

void feed_override_hold(struct feed_override *f)
{
    if (f->state == FEED_RUNNING || f->state == STATE_WAITING) {
        set_state(f, rests(f) ? FEED_HELD : FEED_HOLDING);
        request_stop(f, PROGRAM_STOP_HOLD);
    }
}

void feed_override_resume(struct feed_override *f)
{
    if (f->state == FEED_HOLDING || f->state == FEED_HELD) {
        override_plan_release(&f->plan);
        set_state(f, feed_override_waits(f) ? STATE_WAITING : FEED_RUNNING);
    }
}

void feed_override_set(struct feed_override *f, uint32_t percent)
{
    override_plan_set(&f->plan, percent);
}

static int is_over(const struct feed_override *f)
{
    return f->state == FEED_STOPPED || f->state == FEED_ENDED;
}

void feed_override_stop(struct feed_override *f)
{
    if (is_over(f) || f->state == FEED_STOPPING) {
        return;
    }
    if (rests(f)) {
        set_state(f, FEED_STOPPED);
        return;
    }
    if (f->state == FEED_RUNNING) {
        request_stop(f, PROGRAM_STOP_HOLD);
    }
    set_state(f, FEED_STOPPING);
}

void feed_override_fault_stop(struct feed_override *f)
{
    if (is_over(f) || (f->state == FEED_STOPPING && f->kind == PROGRAM_STOP_FAULT)) {
        return;
    }
    if (rests(f)) {
        set_state(f, FEED_STOPPED);
        return;
    }
    request_stop(f, PROGRAM_STOP_FAULT);
    f->replace = f->phase == PHASE_BRAKE ? 1u : 0u;
    set_state(f, FEED_STOPPING);
}

/* --- State of the nominal motion --- */

static uint32_t override_q30(const struct feed_override *f)
{
    return (uint32_t)(f->plan.now.override_q57 >> 27);
}

/* Program time that passes in a tick, in 2^-40 s per millisecond of the period. */
static uint32_t time_of_tick_q40(const struct feed_override *f)
{
    return (uint32_t)(qmath_product_unsigned(override_q30(f), MS_Q40) >> 30);
}

/* With v the override: speed v F' and acceleration v^2 F'' + v' F', in units of a tick. */
int feed_override_motion(const struct feed_override *f, const struct interpolator *it,
                         struct path_state *state, int64_t *turned_q56)
{
    const struct program_clock *clock = &f->clock;
    const int p = (int)clock->period_log2;
    const uint32_t time_q40 = time_of_tick_q40(f);
    const int64_t feed = f->point.feed_q32_mm_s;
    if (qmath_magnitude(feed) >= MOST_FEED_Q32) {
        return 0;
    }
    const int64_t bend_q40 =
        interpolator_acceleration_q40(it, clock->record, program_clock_time_q42(clock));
    const int64_t even = qmath_mul_unsigned(qmath_mul_unsigned(bend_q40, time_q40), time_q40);
    const int64_t at_override_1 = qmath_mul_unsigned(feed * 65536, MS_Q40);
    const int64_t slope_q56 = qmath_lesser(f->plan.now.slope_q56, MOST_SLOPE_Q56);
    const int64_t turned = qmath_mul_wide(at_override_1, (int32_t)(slope_q56 >> 26)) * 4;
    state->arc_length_q40_mm = f->point.arc_length_q40_mm;
    state->fine_q56_mm = 0;
    state->speed_q56 = qmath_shift_clamp(qmath_mul_unsigned(feed * 65536, time_q40), p);
    *turned_q56 = qmath_shift_clamp(turned, p);
    state->acceleration_q56 = qmath_shift_clamp(even, 2 * p) + *turned_q56;
    return 1;
}

/* --- A tick --- */

static int plan_tick(struct feed_override *f, struct interpolator *it)
{
    const uint64_t time_q42_s = override_plan_tick(&f->plan, &f->clock);
    const int result = interpolator_at_piece(it, f->clock.record, time_q42_s, &f->point);
    if (result == INTERPOLATOR_END) {
        f->state = f->at_end;
    }
    return result;
}

static void come_to_standstill(struct feed_override *f, uint32_t found)
{
    f->phase = PHASE_REST;
    f->found = found;
    if (comes_to_standstill(f)) {
        f->state = f->state == FEED_STOPPING ? FEED_STOPPED : FEED_HELD;
    }
}

/* The point at the arc length of the path stop. */
static int interpolate_brake(struct feed_override *f, struct interpolator *it)
{
    const struct path_state *at = &f->brake.at;
    return interpolator_at_arc_length(it, at->arc_length_q40_mm + (int64_t)(at->fine_q56_mm >> 15),
                                      &f->point);
}

/* The tick that leaves the nominal motion. */
static int first_brake_tick(struct feed_override *f, struct interpolator *it)
{
    f->left_q30 -= TICK_Q30;
    path_brake_first(&f->brake);
    return interpolate_brake(f, it);
}

static int brake_tick(struct feed_override *f, struct interpolator *it)
{
    f->left_q30 -= TICK_Q30;
    path_brake_step(&f->brake);
    const int result = interpolate_brake(f, it);
    if (result == INTERPOLATOR_OK && path_brake_ended(&f->brake)) {
        interpolator_search_begin(&f->place, f->clock.piece, f->point.arc_length_q40_mm);
        come_to_standstill(f, 0);
    }
    return result;
}

/* --- The end of the program --- */

static int fits_before_end(const struct feed_override *f, const struct path_state *from)
{
    const int64_t left_q40_mm = f->clock.program->header.length_q40_mm - from->arc_length_q40_mm;
    return path_brake_fits(from, &f->numbers, left_q40_mm);
}

/* Whether every path stop of the stop table would end before the end of the path, and before the program does. The
 * remainder is rounded down, to micrometres and microseconds. */
static int is_far_from_end(const struct feed_override *f, const struct path_state *from)
{
    const struct program_header *h = &f->clock.program->header;
    const uint32_t distance_um =
        f->kind == PROGRAM_STOP_HOLD ? h->hold_worst_um : h->fault_worst_um;
    const uint32_t time_us = f->kind == PROGRAM_STOP_HOLD ? h->hold_worst_us : h->fault_worst_us;
    const int64_t left_q40_mm = h->length_q40_mm - from->arc_length_q40_mm;
    const int64_t left_q32_s =
        (int64_t)qmath_q32_of_q42(f->clock.duration_q42_s - f->clock.time_q42_s);
    return qmath_mul_unsigned(left_q40_mm, UM_PER_MM) >> 8 >= (int64_t)distance_um &&
           qmath_mul_unsigned(left_q32_s, US_PER_S) >= (int64_t)time_us;
}

/* --- From the nominal motion to the path stop --- */

/* Leaves the nominal motion, if a path stop may begin here. A hold or a stop does not begin while a rising override
 * adds more than a quarter of the deceleration to the acceleration: the override ramp ends early instead. */
static int leave_plan(struct feed_override *f, const struct path_state *state, int64_t turned_q56)
{
    if (f->kind == PROGRAM_STOP_HOLD && turned_q56 > f->numbers.deceleration_q56 / 4) {
        return 0;
    }
    if (!path_brake_begin(&f->brake, state, &f->numbers) ||
        !(is_far_from_end(f, state) || fits_before_end(f, state))) {
        return 0;
    }
    f->phase = PHASE_BRAKE;
    f->replace = 0;
    return 1;
}

/* The nominal motion continues for another tick. At a low override it may take long to the place of the next path stop,
 * so the override goes to 0. At a high one the fall of the override would add to the deceleration of the nominal
 * motion. */
static void wait_slowly(struct feed_override *f)
{
    if (f->plan.now.override_q57 < OVERRIDE_ONE / 2) {
        override_plan_hold(&f->plan);
    } else {
        override_plan_end_rise(&f->plan);
    }
}

/* Leaves the nominal motion, or finds that it ends at standstill by itself. */
static int leaves_or_ends(struct feed_override *f, const struct interpolator *it)
{
    struct path_state state;
    int64_t turned_q56 = 0;
    const int known = feed_override_motion(f, it, &state, &turned_q56);
    const int rests = (f->plan.now.override_q57 | f->plan.now.slope_q56) == 0;
    if (rests || (known && state.speed_q56 < PATH_BRAKE_NO_SPEED && state.acceleration_q56 >= 0)) {
        come_to_standstill(f, 1);
        return 1;
    }
    return known && f->numbers_kind == f->kind && leave_plan(f, &state, turned_q56);
}

/* The nominal motion is in another piece, whose stop parameters are valid from now on. A hold or a stop may have waited
 * for the end of a rise of the override, which the bound of the previous piece does not include: then the bound of this
 * piece counts. */
static void enter_piece(struct feed_override *f)
{
    read_numbers(f);
    if (f->kind == PROGRAM_STOP_HOLD) {
        f->left_q30 = qmath_greater(f->left_q30, deadline_q30(f));
    }
}

/* A stop has been requested during the nominal motion: leaves it, or continues it for another tick. */
static int wait_tick(struct feed_override *f, struct interpolator *it)
{
    if (f->plan.started != 0) {
        if (f->numbers_piece != f->clock.piece) {
            enter_piece(f);
        }
        if (leaves_or_ends(f, it)) {
            return f->phase == PHASE_BRAKE ? first_brake_tick(f, it) : INTERPOLATOR_OK;
        }
        f->left_q30 -= qmath_lesser(override_q30(f), TICK_Q30);
        wait_slowly(f);
    }
    return plan_tick(f, it);
}

/* A fault stop gives its own stop parameters to the path stop of a hold or a stop, if it then still ends on the path.
 * */
static void replace_brake(struct feed_override *f)
{
    const struct path_state at = f->brake.at;
    if (f->numbers_kind == f->kind && fits_before_end(f, &at)) {
        (void)path_brake_begin(&f->brake, &at, &f->numbers);
    }
    f->replace = 0;
}

/* At standstill: searches the program time of the place; continues from there when it is found and the motion is
 * resumed. */
static void search_place(struct feed_override *f, const struct interpolator *it)
{
    for (int i = 0; i < SEARCH_STEPS && f->found == 0; i++) {
        if (interpolator_search_step(it, &f->place)) {
            f->found = 1;
            program_clock_set(&f->clock, f->place.time_q42_s, f->place.piece_index, f->place.piece);
            override_plan_restart(&f->plan);
        }
    }
    if (f->found != 0 && f->state == FEED_RUNNING) {
        f->phase = PHASE_PLAN;
    }
}

int feed_override_stop_tick(struct feed_override *f, struct interpolator *it)
{
    if (f->phase == PHASE_PLAN) {
        return wait_tick(f, it);
    }
    if (f->phase == PHASE_BRAKE) {
        if (f->replace != 0) {
            replace_brake(f);
        }
        return brake_tick(f, it);
    }
    search_place(f, it);
    return f->phase == PHASE_PLAN ? plan_tick(f, it) : INTERPOLATOR_OK;
}

int feed_override_next(struct feed_override *f, struct interpolator *it,
                       struct interpolator_point *out)
{
    const int aside = f->phase != PHASE_PLAN || comes_to_standstill(f);
    const int result = aside ? feed_override_stop_tick(f, it) : plan_tick(f, it);
    if (result < 0) {
        return result;
    }
    interpolator_point_copy(out, &f->point, it->axis_count);
    return 0;
}

/* --- The next chunk --- */

/* In motion: the last setpoint and all up to the joint are the same in both programs. A piece that reaches beyond an
 * end of one of them is not: it is held inside there (core/interpolator). */
static int is_shared(const struct feed_override *f, const struct chunk *next)
{
    const struct program *p = f->clock.program;
    const uint32_t joint = next->piece_shift + next->shared_pieces;
    /* the time is rounded up into a piece: in the first one it may be a unit before */
    if (f->clock.piece < next->piece_shift || f->clock.piece >= joint ||
        f->clock.time_q42_s < qmath_q42_of_q32(next->time_shift_q32_s)) {
        return 0;
    }
    const int64_t start_q40_mm = program_piece_start(p, f->clock.piece) - next->arc_shift_q40_mm;
    return (next->segment_shift == 0u || start_q40_mm >= REACH_Q40) &&
           p->header.length_q40_mm - program_piece_start(p, joint) >= REACH_Q40;
}

/* The nominal motion continues, and an override ramp under way ends before the joint. */
static int may_take_over_moving(const struct feed_override *f, const struct chunk *next)
{
    return f->state == FEED_RUNNING && is_shared(f, next) &&
           override_plan_ends_by(&f->plan, next->joint_time_q32_s);
}

static int may_take_over_resting(const struct feed_override *f, const struct chunk *next)
{
    return !is_over(f) && f->point.arc_length_q40_mm - next->arc_shift_q40_mm >=
                              program_piece_start(&next->program, 0);
}

/* A chunk that begins at rest: at the end of its predecessor. A held path waits. */
static int may_begin_next(const struct feed_override *f)
{
    return f->phase == PHASE_PLAN && f->state == STATE_WAITING;
}

static int may_take_over(const struct feed_override *f, const struct chunk *next)
{
    if (chunk_begins_at_rest(next)) {
        return may_begin_next(f);
    }
    return f->goes_on != 0u && f->phase != PHASE_BRAKE &&
           (rests(f) ? may_take_over_resting(f, next) : may_take_over_moving(f, next));
}

/* For a chunk that begins at rest its start. In motion the same place in the next program; at standstill the search for
 * it begins with the first piece. */
static void place_in_next(const struct feed_override *f, const struct interpolator *it,
                          const struct chunk *next, struct feed_place *place)
{
    if (chunk_begins_at_rest(next)) {
        *place = (struct feed_place){.piece = 0};
        return;
    }
    const int resting = rests(f);
    const uint32_t segment = it->segment->number;
    place->piece = resting ? 0u : f->clock.piece - next->piece_shift;
    place->segment = segment > next->segment_shift ? segment - next->segment_shift : 0u;
    place->arc_length_q40_mm = f->point.arc_length_q40_mm - next->arc_shift_q40_mm;
    place->by_arc = resting ? 1u : 0u;
}

int feed_override_may_take_over(const struct feed_override *f, const struct interpolator *it,
                                const struct chunk *next, struct feed_place *place)
{
    place_in_next(f, it, next, place);
    return may_take_over(f, next);
}

/* At standstill: continues from the same arc length when its time is found. */
static void stand_in_next(struct feed_override *f)
{
    interpolator_search_begin(&f->place, 0, f->point.arc_length_q40_mm);
    f->phase = PHASE_REST;
    f->found = 0;
    f->state = f->state == STATE_WAITING ? FEED_RUNNING : f->state;
}

/* Begins the next program as a program begins. */
static void begin_next(struct feed_override *f, const struct chunk *next,
                       const struct coefficients_piece *first)
{
    program_clock_begin_at_piece(&f->clock, &next->program, f->clock.period_us, first);
    override_plan_begin_next(&f->plan, &next->least);
    f->state = FEED_RUNNING;
}

static void go_on_in_next(struct feed_override *f, const struct chunk *next,
                          const struct feed_place *at, const struct coefficients_piece *record)
{
    const int resting = at->by_arc != 0u;
    /* standstill at its start until the place is found */
    program_clock_carry(&f->clock, &next->program,
                        resting ? f->clock.time_q42_s : qmath_q42_of_q32(next->time_shift_q32_s),
                        at->piece, record);
    override_plan_carry(&f->plan, &next->least, next->time_shift_q32_s);
    if (resting) {
        stand_in_next(f);
    }
}

int feed_override_take_over(struct feed_override *f, struct interpolator *it,
                            const struct chunk *next, const struct coefficients_window *window)
{
    struct feed_place at;
    place_in_next(f, it, next, &at);
    const struct coefficients_piece *record = coefficients_window_piece(window, at.piece);
    const struct coefficients_segment *segment =
        interpolator_segment_in(window, at.segment, at.arc_length_q40_mm);
    if (!may_take_over(f, next) || segment == NULL || (at.by_arc == 0u && record == NULL)) {
        return 0;
    }
    f->point.arc_length_q40_mm = at.arc_length_q40_mm;
    interpolator_carry(it, &next->program, window, segment, &next->end);
    if (chunk_begins_at_rest(next)) {
        begin_next(f, next, record);
    } else {
        go_on_in_next(f, next, &at, record);
    }
    goes_on(f, next);
    return 1;
}

/* --- Its records --- */

/* 1: the program clock is at the place of the motion: not in a path stop, nor until the place of standstill is found.
 * */
static int clock_is_here(const struct feed_override *f)
{
    return f->phase == PHASE_PLAN || (f->phase == PHASE_REST && f->found != 0);
}

void feed_override_place(const struct feed_override *f, const struct interpolator *it,
                         struct feed_place *place)
{
    const int here = clock_is_here(f);
    place->piece = f->phase == PHASE_REST && !here ? f->place.piece_index : f->clock.piece;
    place->segment = it->segment->number;
    place->arc_length_q40_mm = f->point.arc_length_q40_mm;
    place->by_arc = here ? 0u : 1u;
}

/* While the place of standstill is searched only the bisected piece is needed; in a path stop, none. */
int feed_override_use(struct feed_override *f, struct interpolator *it,
                      const struct coefficients_window *window)
{
    const int bisects = f->phase == PHASE_REST && f->found == 0 && f->place.bisecting != 0;
    const uint32_t piece = bisects ? f->place.piece_index : f->clock.piece;
    const struct coefficients_piece *record = coefficients_window_piece(window, piece);
    if (((bisects || clock_is_here(f)) && record == NULL) ||
        coefficients_window_segment(window, it->segment->number) == NULL) {
        return 0;
    }
    override_plan_forget_records(&f->plan);
    f->clock.record = record;
    f->place.piece = record;
    interpolator_use(it, window);
    return 1;
}

/* --- State --- */

enum feed_state feed_override_state(const struct feed_override *f)
{
    return f->state == STATE_WAITING ? FEED_RUNNING : (enum feed_state)f->state;
}

int feed_override_late(const struct feed_override *f)
{
    return comes_to_standstill(f) && f->left_q30 < 0;
}

uint64_t feed_override_time_q42(const struct feed_override *f)
{
    return program_clock_time_q42(&f->clock);
}

uint32_t feed_override_bound_us(const struct feed_override *f, enum program_stop_kind kind)
{
    struct program_stop stop;
    const uint32_t end_us = left_us(f) + END_TICKS * f->clock.period_us;
    program_stop_get(f->clock.program, f->clock.piece, kind, &stop);
    return end_us > stop.bound_us && end_us / 2u < stop.bound_us ? end_us : stop.bound_us;
}

int64_t feed_override_feed_q32(const struct feed_override *f)
{
    if (rests(f) || is_over(f)) {
        return 0;
    }
    if (f->phase == PHASE_BRAKE) {
        /* 2^-56 mm a tick in 2^-32 mm/s: 1000 / 2^24 for each ms of the period */
        const int64_t speed = f->brake.at.speed_q56 >> (int)f->clock.period_log2;
        return qmath_mul_unsigned(speed, 1000u << 8);
    }
    const int64_t feed = f->point.feed_q32_mm_s;
    const uint32_t now_q30 = override_q30(f);
    return now_q30 == (uint32_t)TICK_Q30 ? feed : qmath_mul_unsigned(feed, now_q30) * 4;
}

uint32_t feed_override_actual_q30(const struct feed_override *f)
{
    return f->phase == PHASE_PLAN && !rests(f) && !is_over(f) ? override_q30(f) : 0u;
}

int feed_override_saturated(const struct feed_override *f)
{
    return f->phase == PHASE_PLAN &&
           (f->plan.saturated != 0 || f->plan.requested_q57 > f->plan.most_q57);
}
