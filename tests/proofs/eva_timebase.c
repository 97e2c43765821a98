/* SPDX-License-Identifier: MIT */
/*
 * A tick of the timebase, for any program of three pieces, with records and without, wherever its time and its plan are
 * and after any command: nothing overflows, no window asks for what is behind the last piece. Which piece it is in: cbmc_ends.c.
 *
 * prover: eva
 * options: -eva-slevel 10
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/timebase_step.c: timebase_find_piece(tb, time_q42_s, TIMEBASE_MOST_ENDS); => (void)timebase_find_piece;
 * assumes: qmath_div_u64 program_piece_duration rate_bounds_of rate_pace_make rate_ticks_of rate_step_of rate_span_q32
 * mutant: core/rate_window.c: behind < left ? behind : left => behind
 * mutant: core/rate_plan.c: tb->plan.window < RATE_WINDOWS => tb->plan.window <= RATE_WINDOWS
 * mutant: core/timebase_change.c: 3 * tb->now.rate_q57 => 64 * tb->now.rate_q57
 */
#include "core/timebase.h"
#include "proof.h"

/* Its value: test_qmath.c. */
/*@ requires b != 0;
    assigns \result \from a, b;
    ensures \result == a / b; */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 < \result <= (1 << 54); */
uint64_t program_piece_duration(const struct program *p, uint32_t i);

/* eva_rate.c has these. */
/*@ requires first < p->header.piece_count && count > 0;
    assigns *out \from first, count;
    ensures \initialized(out); */
void rate_bounds_of(struct rate_bounds *out, const struct program *p, uint32_t first,
                    uint32_t count);

/*@ predicate is_pace(struct rate_pace *pace) =
      0x1000000 <= pace->factor_q24 <= 0x2000000 && pace->turns >= 1; */
/*@ requires \initialized(bounds);
    assigns *out \from period_us;
    ensures \initialized(out) && is_pace(out); */
void rate_pace_make(struct rate_pace *out, const struct rate_bounds *bounds, uint32_t period_us);

/*@ requires -(1 << 60) <= way_q57 <= (1 << 60) && \initialized(pace);
    assigns *ticks \from way_q57;
    ensures \initialized(ticks) && ticks->rise >= 1 && ticks->half >= 1; */
void rate_ticks_of(struct rate_ticks *ticks, const struct rate_pace *pace, int64_t way_q57);

/*@ requires ticks->rise >= 1 && ticks->half >= 1 && -(1 << 60) <= way_q57 <= (1 << 60);
    assigns \result \from way_q57;
    ensures 0 <= \result <= (1 << 59); */
int64_t rate_step_of(const struct rate_ticks *ticks, int64_t way_q57);

/*@ requires \initialized(ticks);
    assigns \result \from mean_q57, period_q32_s; */
uint64_t rate_span_q32(const struct rate_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s);

#include "core/rate.c"
#include "core/rate_plan.c"
#define climb search_climb
#include "core/rate_search.c"
#undef climb
#define look window_look
#include "core/rate_window.c"
#undef look
#include "core/timebase.c"
#include "core/timebase_change.c"
#include "core/timebase_step.c"

#define COUNT 3u

static uint64_t records[COUNT * sizeof(struct prepared_piece) / 8];

static const struct kernel any_kernel = {.piece_size = sizeof(struct feed_piece)};

static struct rate_ticks any_ticks(void)
{
    struct rate_ticks t = {(uint32_t)any_between(1, UINT32_MAX),
                           (uint32_t)any_between(1, UINT32_MAX)};
    return t;
}

/* Whatever the plan is: rates up to RATE_MOST, slopes and steps up to half of it (section 15.4). */
static void set_plan(struct timebase *tb)
{
    struct rate_plan *plan = &tb->plan;
    Frama_C_make_unknown((char *)plan, sizeof *plan);
    plan->window = (uint32_t)any_between(0, RATE_WINDOWS);
    plan->goal_q57 = any_between(0, RATE_MOST);
    plan->wanted_q57 = any_between(-1, RATE_MOST);
    plan->move.step_q56 = any_between(-RATE_ONE, RATE_ONE);
    plan->move.rest_q57 = any_between(-POWER(60), POWER(60));
    plan->ticks = any_ticks();
    plan->back = any_ticks();
    tb->now.rate_q57 = any_between(0, RATE_MOST);
    tb->now.slope_q56 = any_between(-RATE_ONE, RATE_ONE);
}

static void command(struct timebase *tb)
{
    switch (any_between(0, 4)) {
    case 0:
        timebase_hold(tb);
        break;
    case 1:
        timebase_resume(tb);
        break;
    case 2:
        timebase_stop(tb);
        break;
    case 3:
        timebase_override(tb, (uint32_t)any_between(0, UINT32_MAX));
        break;
    default:
        break;
    }
}

/* In piece i: its end is beyond the present time. */
static void place(struct timebase *tb, uint32_t i)
{
    const struct program *p = tb->program;
    tb->piece = i;
    tb->time_q42_s = (uint64_t)any_between(0, INT64_MAX);
    tb->piece_end_q42_s = timebase_end_q42_s(tb, (uint64_t)any_between(0, INT64_MAX));
    if (p->prepared_for != NULL) {
        tb->record = prepared_piece_at(p, p->prepared_for, i);
    }
    tb->rest = (uint32_t)any_between(0, TIMEBASE_REST_UNIT - 1);
    tb->fine = (uint32_t)any_between(0, (1 << TIMEBASE_FINE_BITS) - 1);
    tb->state = (uint32_t)any_between(0, 5);
    tb->steady = (uint32_t)any_between(0, 1);
    tb->started = (uint32_t)any_between(0, 1);
}

static void tick(const struct program *p)
{
    struct timebase tb;
    timebase_begin(&tb, p, (uint32_t)any_between(1000, 8000));
    //@ loop unroll 3;
    for (uint32_t i = 0; i < COUNT; i++) {
        set_plan(&tb);
        place(&tb, i);
        command(&tb);
        timebase_step_q42(&tb);
        timebase_rate_q30(&tb);
    }
}

int main(void)
{
    struct program p;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.header.piece_count = COUNT;
    p.header.duration_q32_s = (uint64_t)any_between(1, POWER(53));
    p.prepared = NULL;
    p.prepared_for = NULL;
    tick(&p);
    Frama_C_make_unknown((char *)records, sizeof records);
    p.prepared = (const uint8_t *)records;
    p.prepared_for = &any_kernel;
    for (uint32_t i = 0; i < COUNT; i++) {
        struct prepared_piece *record = (void *)prepared_piece_at(&p, &any_kernel, i);
        record->end_q32_s = i + 1 == COUNT ? UINT64_MAX : (uint64_t)any_between(1, POWER(54));
        for (uint32_t k = 0; k < RATE_WINDOWS; k++) {
            record->ahead[k].factor_q24 = (uint32_t)any_between(1 << 24, 1 << 25);
        }
    }
    tick(&p);
    reached();
    return 0;
}
