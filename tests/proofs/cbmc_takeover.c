/* SPDX-License-Identifier: MIT */
/*
 * The takeover of the next chunk (docs/theory/proofs.md section 15.7): whatever the state of the motion, after any
 * tick, command, takeover or other records the program under way is one of the two, at one of its pieces, with what
 * its end means and, where the plan goes on, with the record of that piece. A stop and a hold are never lost, a job
 * that goes on never counts as ended, a takeover in motion keeps time and piece, and other records change nothing
 * else.
 *
 * The functions that the motion calls do anything that their headers allow. Analysed by CBMC in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 4 --unwinding-assertions --signed-overflow-check
 * shows: feed_override_take_over feed_override_waits feed_override_use feed_override_may_take_over feed_override_place
 * mutant: core/feed_override.c: return f->goes_on != 0u && f->phase != PHASE_BRAKE && => return f->goes_on != 0u &&
 * mutant: core/feed_override.c: f->clock.piece >= joint || => f->clock.piece > joint ||
 * mutant: core/feed_override.c: return f->state == FEED_RUNNING && is_shared => return is_shared
 * mutant: core/feed_override.c: override_plan_ends_by(&f->plan, next->joint_time_q32_s); => 1;
 * mutant: core/feed_override.c: f->clock.time_q42_s < qmath_q42_of_q32(next->time_shift_q32_s)) => 0)
 * mutant: core/feed_override.c: return !is_over(f) && f->point => return f->point
 * mutant: core/feed_override.c: f->state == STATE_WAITING ? FEED_RUNNING : f->state; => FEED_RUNNING;
 * mutant: core/feed_override.c: f->at_end = f->goes_on != 0u ? state_at_tail_end(state) : FEED_ENDED; => f->at_end = FEED_ENDED;
 * mutant: core/feed_override.c: return state == FEED_HOLDING || state == FEED_HELD ? FEED_HELD : FEED_STOPPED; => return FEED_STOPPED;
 * mutant: core/feed_override.c: 0u : f->clock.piece - next->piece_shift; => 0u : f->clock.piece;
 * mutant: core/feed_override.c: segment == NULL || (at.by_arc == 0u && record == NULL)) { => segment == NULL) {
 * mutant: core/feed_override.c: || segment == NULL || => ||
 * mutant: core/feed_override.c: if (((bisects || clock_is_here(f)) && record == NULL) || => if ((bisects && record == NULL) ||
 * mutant: core/feed_override.c: if (((bisects || clock_is_here(f)) && record == NULL) || => if ((clock_is_here(f) && record == NULL) ||
 * mutant: core/feed_override.c: override_plan_forget_records(&f->plan); =>
 * mutant: core/feed_override.c: return f->phase == PHASE_PLAN && f->state == STATE_WAITING; => return f->phase == PHASE_PLAN;
 * mutant: core/feed_override.c: return f->phase == PHASE_PLAN && f->state == STATE_WAITING; => return f->state == FEED_HELD || f->state == STATE_WAITING;
 */
#include <stddef.h>

#include "core/feed_override.h"
#include "proof.h"

int nondet_int(void);

#define PIECES 3u
#define LENGTH POWER(61)

/* --- Two chunks, the second after the first --- */

static struct chunk chunks[2];
static struct coefficients_piece records[2][PIECES]; /* in order, without gaps */
static int64_t starts[2][PIECES];
static struct coefficients_segment segments[2]; /* one for all of each */
static struct coefficients_window window;       /* new records, or the next chunk's */
static const struct kernel kernel = {
    .piece_size = sizeof(struct coefficients_piece) - offsetof(struct coefficients_piece, feed)};

static uint32_t number_of(const struct program *p)
{
    return p == &chunks[1].program ? 1u : 0u;
}

int64_t program_piece_start(const struct program *p, uint32_t i)
{
    prove(i < p->header.piece_count);
    return starts[number_of(p)][i];
}

static void any_chunk(uint32_t n)
{
    struct chunk *c = &chunks[n];
    c->flags = nondet_uint32() & (CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST | CHUNK_FLAG_REST);
    c->program.header.piece_count = (uint32_t)any_between(1, PIECES);
    c->program.header.length_q40_mm = any_between(1, LENGTH);
    c->program.header.axis_count = PROGRAM_PLANE;
    uint64_t time = 0;
    int64_t arc = n == 0u ? 0 : any_between(0, LENGTH);
    for (uint32_t i = 0; i < PIECES && i < c->program.header.piece_count; i++) {
        const uint64_t duration_q32 = (uint64_t)any_between(1, POWER(50));
        starts[n][i] = arc;
        records[n][i].start_q42_s = time;
        records[n][i].number = i;
        time += duration_q32 << 10;
        records[n][i].end_q42_s = time;
        arc = any_between(arc, LENGTH);
        assume(starts[n][i] <= c->program.header.length_q40_mm);
    }
    c->program.header.duration_q32_s = time >> 10;
}

/* What chunk_check has found. */
static void second_follows_first(void)
{
    struct chunk *next = &chunks[1];
    const uint32_t before = chunks[0].program.header.piece_count;
    if (chunk_begins_at_rest(next)) {
        return; /* no shifts, shares nothing */
    }
    next->piece_shift = (uint32_t)any_between(0, PIECES);
    next->shared_pieces = (uint32_t)any_between(1, PIECES);
    assume(next->piece_shift + next->shared_pieces < before);
    assume(next->shared_pieces <= next->program.header.piece_count);
    next->time_shift_q32_s = records[0][next->piece_shift].start_q42_s >> 10;
    next->joint_time_q32_s = records[0][next->piece_shift + next->shared_pieces].start_q42_s >> 10;
    next->arc_shift_q40_mm = any_between(0, LENGTH);
    next->segment_shift = (uint32_t)any_between(0, 9);
    assume(next->segment_shift != 0u || next->arc_shift_q40_mm == 0);
    for (uint32_t i = 0; i < PIECES && i < next->shared_pieces; i++) {
        const uint32_t k = next->piece_shift + i;
        assume(starts[1][i] == starts[0][k] - next->arc_shift_q40_mm);
        assume(records[1][i].end_q42_s - records[1][i].start_q42_s ==
               records[0][k].end_q42_s - records[0][k].start_q42_s);
        assume(records[1][i].start_q42_s ==
               records[0][k].start_q42_s - (next->time_shift_q32_s << 10));
    }
}

/* Records of any pieces of a program in a row, or of none; and the segment of the motion, or not. */
static void any_window(uint32_t n)
{
    const uint32_t first = (uint32_t)any_between(0, PIECES - 1u);
    window.kernel = &kernel;
    window.first_piece = first;
    window.piece_count = (uint32_t)any_between(0, PIECES);
    assume(first + window.piece_count <= chunks[n].program.header.piece_count);
    window.pieces = (const uint8_t *)&records[n][first];
    window.first_segment = nondet_uint32() & 1u;
    window.segment_count = nondet_uint32() & 1u;
    window.segments = (const uint8_t *)&segments[n];
    window.segment_step = 0;
}

/* --- What the motion calls --- */

static int may_carry;           /* what override_plan_ends_by has said, */
static uint64_t carry_by_q32_s; /* and of which time */
static uint32_t carried;
static uint32_t let_go;

int override_plan_ends_by(const struct override_plan *plan, uint64_t time_q32_s)
{
    (void)plan;
    may_carry = nondet_int() != 0;
    carry_by_q32_s = time_q32_s;
    return may_carry;
}

void override_plan_carry(struct override_plan *plan, const struct program_override *least,
                         uint64_t shift_q32_s)
{
    (void)plan;
    prove(least == &chunks[1].least && shift_q32_s == chunks[1].time_shift_q32_s);
    carried++;
}

void override_plan_forget_records(struct override_plan *plan)
{
    (void)plan;
    let_go++;
}

void override_plan_begin(struct override_plan *plan, const struct program *p)
{
    (void)plan;
    (void)p;
}

void override_plan_begin_next(struct override_plan *plan, const struct program_override *least)
{
    prove(least == &chunks[1].least);
    plan->started = 0;
    carried++;
}

void override_plan_limit(struct override_plan *plan, int64_t most_q57)
{
    prove(most_q57 == OVERRIDE_ONE || most_q57 == OVERRIDE_MOST);
    plan->most_q57 = most_q57;
}

void override_plan_restart(struct override_plan *plan)
{
    plan->started = 1;
}

void override_plan_set(struct override_plan *plan, uint32_t percent)
{
    (void)percent;
    plan->requested_q57 = any_between(0, OVERRIDE_MOST);
}

void override_plan_hold(struct override_plan *plan)
{
    plan->held = 1;
}

void override_plan_release(struct override_plan *plan)
{
    plan->held = 0;
}

void override_plan_end_rise(struct override_plan *plan)
{
    (void)plan;
}

static void any_piece(struct program_clock *clock, uint32_t from)
{
    const uint32_t n = number_of(clock->program);
    clock->piece = (uint32_t)any_between(from, chunks[n].program.header.piece_count - 1u);
    clock->record = &records[n][clock->piece];
}

/* On to a later time, at the end to none; a unit below the piece by rounding. */
uint64_t override_plan_tick(struct override_plan *plan, struct program_clock *clock)
{
    plan->now.override_q57 = any_between(0, OVERRIDE_MOST);
    plan->now.slope_q56 = any_between(-POWER(57), POWER(57));
    if (clock->time_q42_s != clock->duration_q42_s && nondet_int() != 0) {
        any_piece(clock, clock->piece);
        clock->time_q42_s = nondet_uint64();
        assume(clock->time_q42_s + 1u >= clock->record->start_q42_s &&
               clock->time_q42_s < clock->record->end_q42_s);
        return clock->time_q42_s;
    }
    clock->time_q42_s = clock->duration_q42_s;
    return clock->duration_q42_s;
}

static void any_point(const struct interpolator *it, struct interpolator_point *out)
{
    out->arc_length_q40_mm = any_between(0, it->length_q40_mm);
    out->feed_q32_mm_s = any_between(-POWER(62), POWER(62));
}

int interpolator_at_piece(struct interpolator *it, const struct coefficients_piece *piece,
                          uint64_t time_q42_s, struct interpolator_point *out)
{
    (void)piece;
    if (time_q42_s >= it->duration_q42_s) {
        out->arc_length_q40_mm = it->length_q40_mm;
        return INTERPOLATOR_END;
    }
    any_point(it, out);
    return INTERPOLATOR_OK;
}

int interpolator_at_arc_length(struct interpolator *it, int64_t arc_length_q40_mm,
                               struct interpolator_point *out)
{
    (void)arc_length_q40_mm;
    any_point(it, out);
    return INTERPOLATOR_OK;
}

int64_t interpolator_acceleration_q40(const struct interpolator *it,
                                      const struct coefficients_piece *piece, uint64_t time_q42_s)
{
    (void)it;
    (void)piece;
    (void)time_q42_s;
    return any_between(-POWER(40), POWER(40));
}

void interpolator_point_copy_others(struct interpolator_point *out,
                                  const struct interpolator_point *from, uint32_t axis_count)
{
    (void)out;
    (void)from;
    (void)axis_count;
}

void interpolator_begin_window(struct interpolator *at, const struct program *p,
                               const struct coefficients_window *w)
{
    (void)at;
    (void)p;
    (void)w;
}

const struct coefficients_segment *interpolator_segment_in(const struct coefficients_window *w,
                                                           int64_t number, int64_t arc_length_q40_mm)
{
    prove(w == &window && number >= 0 && arc_length_q40_mm <= LENGTH);
    return nondet_int() != 0 ? &segments[1] : NULL;
}

void interpolator_use(struct interpolator *at, const struct coefficients_window *w)
{
    prove(w == &window && coefficients_window_segment(w, at->segment->number) != NULL);
}

void interpolator_carry(struct interpolator *at, const struct program *p,
                        const struct coefficients_window *w,
                        const struct coefficients_segment *segment,
                        const struct interpolator_point *end)
{
    prove(w == &window && p == &chunks[1].program && end == &chunks[1].end);
    prove(segment == &segments[1]);
    at->program = p;
    at->segment = segment;
    at->duration_q42_s = p->header.duration_q32_s << 10;
    at->length_q40_mm = p->header.length_q40_mm;
}

void interpolator_search_begin(struct interpolator_search *search, uint32_t index,
                               int64_t arc_length_q40_mm)
{
    search->piece = NULL;
    search->piece_index = index;
    search->bisecting = 0;
    search->arc_length_q40_mm = arc_length_q40_mm;
}

/* Into a piece of which there is a record, and in the end the time; or it waits. */
int interpolator_search_step(const struct interpolator *at, struct interpolator_search *search)
{
    const uint32_t n = number_of(at->program);
    if (search->bisecting == 0u) {
        search->piece_index = (uint32_t)any_between(0, chunks[n].program.header.piece_count - 1u);
        if (nondet_int() != 0) {
            search->piece = &records[n][search->piece_index];
            search->bisecting = 1;
        }
        return 0;
    }
    prove(search->piece == &records[n][search->piece_index]);
    search->time_q42_s = search->piece->start_q42_s;
    return nondet_int() != 0;
}

void program_stop_get(const struct program *p, uint32_t i, enum program_stop_kind kind,
                      struct program_stop *out)
{
    (void)kind;
    prove(i < p->header.piece_count);
    out->bound_us = nondet_uint32();
}

int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us)
{
    (void)stop;
    (void)period_us;
    out->deceleration_q56 = any_between(0, POWER(58));
    return nondet_int() != 0;
}

int path_brake_begin(struct path_brake *brake, const struct path_state *from,
                     const struct path_brake_numbers *numbers)
{
    (void)from;
    (void)numbers;
    brake->at.arc_length_q40_mm = any_between(0, LENGTH);
    return nondet_int() != 0;
}

int path_brake_fits(const struct path_state *from, const struct path_brake_numbers *numbers,
                    int64_t distance_left_q40_mm)
{
    (void)from;
    (void)numbers;
    (void)distance_left_q40_mm;
    return nondet_int() != 0;
}

void path_brake_first(struct path_brake *brake)
{
    brake->at.arc_length_q40_mm = any_between(0, LENGTH);
}

void path_brake_step(struct path_brake *brake)
{
    brake->at.arc_length_q40_mm = any_between(0, LENGTH);
}

int path_brake_ended(const struct path_brake *brake)
{
    (void)brake;
    return nondet_int() != 0;
}

uint64_t qmath_div_u64(uint64_t a, uint64_t b)
{
    prove(b != 0);
    (void)a;
    return nondet_uint64() >> 24;
}

int64_t qmath_shift_clamp(int64_t a, int shift)
{
    (void)a;
    (void)shift;
    return any_between(-POWER(61), POWER(61));
}

void *memset(void *to, int value, size_t size)
{
    (void)value;
    (void)size;
    return to;
}

#include "core/feed_override.c"
#include "core/program_clock.c"

/* --- The invariant --- */

static struct feed_override f;
static struct interpolator it;

static int state_fits_phase(void)
{
    const uint32_t s = f.state;
    if (f.phase == PHASE_BRAKE) {
        return s == FEED_RUNNING || s == FEED_HOLDING || s == FEED_STOPPING;
    }
    if (f.phase == PHASE_REST) {
        return s == FEED_RUNNING || s == FEED_HELD || s == FEED_STOPPED;
    }
    /* the plan: at its end, and nowhere else, it rests */
    const int at_end = s == STATE_WAITING || s == FEED_HELD || s == FEED_STOPPED || s == FEED_ENDED;
    return s <= STATE_WAITING && (!at_end || f.clock.time_q42_s == f.clock.duration_q42_s) &&
           (f.goes_on != 0u || !at_end || s == FEED_ENDED);
}

static int end_is_known(void)
{
    if (f.goes_on != 0u) {
        return f.state != FEED_ENDED && f.at_end == state_at_tail_end(f.state);
    }
    return f.state != STATE_WAITING && f.at_end == FEED_ENDED;
}

/* The record of the piece where the plan goes on, or will; that of the piece looked into. */
static int records_are_right(uint32_t n)
{
    const int rests_unknown = f.phase == PHASE_REST && f.found == 0u;
    const int goes_by_plan = f.phase == PHASE_PLAN || (f.phase == PHASE_REST && !rests_unknown);
    return (!goes_by_plan || f.clock.record == &records[n][f.clock.piece]) &&
           (!rests_unknown || f.place.bisecting == 0u ||
            f.place.piece == &records[n][f.place.piece_index]);
}

static int is_sound(uint32_t n)
{
    const struct program *p = &chunks[n].program;
    return f.clock.program == p && it.program == p && f.clock.piece < p->header.piece_count &&
           (f.phase != PHASE_REST || f.found != 0u ||
            f.place.piece_index < p->header.piece_count) &&
           records_are_right(n) &&
           it.segment == &segments[n] &&
           f.clock.duration_q42_s == p->header.duration_q32_s << 10 &&
           it.duration_q42_s == f.clock.duration_q42_s &&
           it.length_q40_mm == p->header.length_q40_mm && f.clock.time_q42_s <= f.clock.duration_q42_s &&
           f.goes_on == (chunk_goes_on(&chunks[n]) ? 1u : 0u) && f.phase <= PHASE_REST &&
           f.point.arc_length_q40_mm >= 0 && f.point.arc_length_q40_mm <= LENGTH &&
           end_is_known() && state_fits_phase();
}

static void any_motion(uint32_t n)
{
    f.clock.program = &chunks[n].program;
    it.program = &chunks[n].program;
    it.axis_count = PROGRAM_PLANE;
    it.segment = &segments[n];
    segments[0].number = nondet_uint32() & 15u;
    segments[1].number = nondet_uint32() & 15u;
    f.clock.period_us = 1000;
    f.clock.period_log2 = 0;
    f.clock.remainder = (uint32_t)any_between(0, PROGRAM_CLOCK_REMAINDER_UNIT - 1u);
    f.clock.fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
    f.clock.duration_q42_s = f.clock.program->header.duration_q32_s << 10;
    it.duration_q42_s = f.clock.duration_q42_s;
    it.length_q40_mm = f.clock.program->header.length_q40_mm;
    any_piece(&f.clock, 0);
    f.clock.time_q42_s = nondet_uint64();
    assume(f.clock.time_q42_s + 1u >= f.clock.record->start_q42_s &&
           f.clock.time_q42_s <= f.clock.record->end_q42_s);
    f.place.bisecting = nondet_uint32() & 1u;
    f.place.piece_index = (uint32_t)any_between(0, PIECES - 1u);
    f.place.piece = nondet_int() != 0 ? &records[n][f.place.piece_index] : NULL;
    f.clock.record = nondet_int() != 0 ? f.clock.record : NULL;
    f.goes_on = chunk_goes_on(&chunks[n]) ? 1u : 0u;
    f.state = nondet_uint32();
    f.at_end = nondet_uint32();
    f.phase = nondet_uint32();
    f.kind = nondet_uint32() & 1u;
    f.found = nondet_uint32() & 1u;
    f.replace = nondet_uint32() & 1u;
    f.numbers_piece = nondet_uint32();
    f.numbers_kind = nondet_uint32();
    f.left_q30 = any_between(-POWER(60), POWER(60));
    f.point.arc_length_q40_mm = nondet_int64();
    f.point.feed_q32_mm_s = any_between(-POWER(62), POWER(62));
    f.plan.started = nondet_uint32() & 1u;
    f.plan.now.override_q57 = any_between(0, OVERRIDE_MOST);
    f.plan.now.slope_q56 = any_between(-POWER(57), POWER(57));
    assume(is_sound(n));
}

/* --- One step --- */

static int stops(uint32_t state)
{
    return state == FEED_STOPPING || state == FEED_STOPPED;
}

static int holds(uint32_t state)
{
    return state == FEED_HOLDING || state == FEED_HELD;
}

/* A stop stays one; a hold, too, but for a command to go on or to stop. Only a program without a next chunk ends. */
static void kept(const struct feed_override *before, int commanded)
{
    const int ended = f.state == FEED_ENDED;
    prove(!ended || f.goes_on == 0u);
    prove(!stops(before->state) || stops(f.state) || ended);
    prove(before->state != FEED_STOPPED || f.state == FEED_STOPPED);
    prove(!holds(before->state) || commanded || holds(f.state) || ended);
    prove(before->state != FEED_ENDED || ended);
}

static void tick_or_command(uint32_t n)
{
    const struct feed_override before = f;
    struct interpolator_point point;
    const int what = nondet_int();
    int commanded = 0;
    if (what == 0) {
        prove(feed_override_next(&f, &it, &point) == 0);
    } else if (what == 1) {
        feed_override_hold(&f);
    } else if (what == 2) {
        feed_override_set(&f, nondet_uint32());
    } else {
        commanded = 1;
        if (what == 3) {
            feed_override_resume(&f);
        } else if (what == 4) {
            feed_override_stop(&f);
        } else {
            feed_override_fault_stop(&f);
        }
    }
    prove(is_sound(n));
    kept(&before, commanded);
}

/* In motion: the same instant in a shared piece, and a ramp under way ends by the joint. */
static void kept_in_motion(const struct feed_override *before)
{
    const struct chunk *next = &chunks[1];
    const uint32_t joint = next->piece_shift + next->shared_pieces;
    prove(before->phase == PHASE_PLAN && before->state == FEED_RUNNING);
    prove(may_carry && carry_by_q32_s == records[0][joint].start_q42_s >> 10);
    prove(before->clock.piece == f.clock.piece + next->piece_shift);
    prove(f.clock.piece < next->shared_pieces);
    prove(before->clock.time_q42_s == f.clock.time_q42_s + (next->time_shift_q32_s << 10) &&
          before->clock.time_q42_s >= f.clock.time_q42_s);
    prove(f.clock.time_q42_s + 1u >= f.clock.record->start_q42_s &&
          f.clock.time_q42_s <= f.clock.record->end_q42_s);
    prove(f.phase == PHASE_PLAN && f.state == FEED_RUNNING);
    prove(f.plan.now.override_q57 == before->plan.now.override_q57 &&
          f.plan.now.slope_q56 == before->plan.now.slope_q56);
}

/* At standstill: it stays there, and searches the place; a hold is still one. */
static void kept_at_rest(const struct feed_override *before)
{
    prove(!stops(before->state) && before->state != FEED_ENDED);
    prove(f.phase == PHASE_REST && f.found == 0u);
    prove(f.state == (holds(before->state) ? (uint32_t)FEED_HELD : (uint32_t)FEED_RUNNING));
    prove(f.place.piece_index == 0u && f.place.arc_length_q40_mm == f.point.arc_length_q40_mm);
    prove(f.point.arc_length_q40_mm >= starts[1][0]);
}

/* After a rest: as at the start of a program, running before and after. */
static void begun_at_rest(const struct feed_override *before)
{
    prove(before->phase == PHASE_PLAN && before->state == STATE_WAITING);
    prove(f.phase == PHASE_PLAN && f.state == FEED_RUNNING && f.plan.started == 0);
    prove(f.clock.piece == 0u && f.clock.time_q42_s == 0u && f.clock.remainder == 0u &&
          f.clock.fine == 0u && f.point.arc_length_q40_mm == 0);
}

static void take_over(void)
{
    const int resting = rests(&f);
    /* a piece reaches no further before its start (protocol.md 1.3) */
    assume(resting || f.point.arc_length_q40_mm >= starts[0][f.clock.piece] - REACH_Q40);
    const struct feed_override before = f;
    if (feed_override_take_over(&f, &it, &chunks[1], &window) == 0) {
        prove(is_sound(0) && carried == 0u);
        prove(f.state == before.state && f.phase == before.phase && f.at_end == before.at_end &&
              f.clock.time_q42_s == before.clock.time_q42_s && f.clock.piece == before.clock.piece &&
              f.found == before.found &&
              f.point.arc_length_q40_mm == before.point.arc_length_q40_mm);
        return;
    }
    prove(before.goes_on == 1u && carried == 1u);
    prove(before.phase != PHASE_BRAKE);
    if (chunk_begins_at_rest(&chunks[1])) {
        begun_at_rest(&before);
        prove(is_sound(1));
        kept(&before, 0);
        return;
    }
    prove(f.clock.remainder == before.clock.remainder && f.clock.fine == before.clock.fine);
    prove(before.point.arc_length_q40_mm ==
          f.point.arc_length_q40_mm + chunks[1].arc_shift_q40_mm);
    if (resting) {
        kept_at_rest(&before);
    } else {
        kept_in_motion(&before);
    }
    prove(is_sound(1));
    kept(&before, 0);
    reached();
}

static void same_motion(const struct feed_override *before)
{
    prove(f.state == before->state && f.phase == before->phase && f.at_end == before->at_end &&
          f.clock.time_q42_s == before->clock.time_q42_s && f.clock.piece == before->clock.piece &&
          f.found == before->found && f.place.piece_index == before->place.piece_index &&
          f.place.bisecting == before->place.bisecting &&
          f.point.arc_length_q40_mm == before->point.arc_length_q40_mm);
}

/* Other records of the program under way: only these of all change, and no record before is in use. */
static void use_records(uint32_t n)
{
    const struct feed_override before = f;
    struct feed_place place;
    feed_override_place(&f, &it, &place);
    prove(place.piece < chunks[n].program.header.piece_count);
    const int used = feed_override_use(&f, &it, &window);
    prove(is_sound(n));
    same_motion(&before);
    prove(let_go == (used ? 1u : 0u));
    prove(used || (f.clock.record == before.clock.record && f.place.piece == before.place.piece));
    prove(!used || f.clock.record == NULL ||
          f.clock.record == coefficients_window_piece(&window, f.clock.record->number));
    prove(!used || f.place.piece == f.clock.record);
}

void harness(void)
{
    any_chunk(0);
    any_chunk(1);
    second_follows_first();
    const uint32_t n = nondet_uint32() & 1u;
    any_motion(n);
    if (n == 0u && nondet_int() != 0) {
        any_window(1);
        take_over();
    } else if (nondet_int() != 0) {
        any_window(n);
        use_records(n);
    } else {
        tick_or_command(n);
    }
}
