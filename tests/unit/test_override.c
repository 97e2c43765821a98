/* SPDX-License-Identifier: MIT */
/*
 * Property test of the feed override: random programs, instants and sequences of hold, resume, override, stop and fault
 * stop. Each tick is checked against what docs/reference/protocol.md 1.3 and 1.4 and docs/theory/feed.md sections 7
 * and 12 promise: bounds of every piece touched, feed, acceleration and jerk on the path (from the rate and F, and by
 * differences of the setpoints), setpoints on the curve, brakes inside their numbers, stops inside their bounds,
 * states, end.
 *
 * HODOGRAPH_CASES: how many; HODOGRAPH_SEED: another sequence. Run by `make unit`; reads files of tests/data.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/feed_override.h"
#include "core/interpolator.h"
#include "core/program_time.h"
#include "golden.h"
#include "override_program.h"
#include "unity.h"

#ifdef __SANITIZE_ADDRESS__
#define CASES 10000u
#else
#define CASES 100000u
#endif
#define LINES 24u
#define RUNS                                                                                       \
    8u /* cases with one program and one choice of limits: preparing costs more than a case */

static const char *const GOLDEN[] = {"alpha_minimax.hdgp", "alpha_exponential.hdgp",
                                     "heart_minimax.hdgp", "line.hdgp", "star_minimax.hdgp"};
#define GOLDENS (sizeof GOLDEN / sizeof *GOLDEN)

enum wanted { RUN, HOLD, STOP };
enum phase { PLAN, BRAKE, REST }; /* of feed_override.c */

static struct override_program bank[4][LINES];
static struct override_program goldens[GOLDENS];
static struct golden_precomputed fixed, exact; /* the program that runs, for two kernels */

static struct {
    struct override_program *p;
    int line;
    uint32_t period_us;
} chosen; /* what the cases of one group run */

static struct {
    const struct override_program *p;
    struct feed_override feed;
    struct interpolator interp;
    struct interpolator exact;
    struct interpolator_point point;
    double h;
    enum wanted wanted;
    int fault;         /* a fault stop was requested */
    unsigned asked;    /* tick of the last hold, stop or fault stop, */
    uint32_t bound_us; /* and its bound */
    uint32_t percent;
    int line;
    unsigned number;
    struct override_trace trace;
    uint64_t time_q42;
    double time_s;
    uint32_t piece;
    double worst_acceleration, worst_jerk; /* parts of the limits */
    unsigned ticks;
} now;

static struct {
    double acceleration, jerk, difference, of_bound;
    uint64_t ticks;
    unsigned over, ended, held, stopped, saturated;
} worst;

static char message[200];

void setUp(void)
{
}

void tearDown(void)
{
}

static const char *where(const char *what, double a, double b)
{
    snprintf(message, sizeof message, "case %u tick %u: %s: %.12g, %.12g", now.number, now.ticks,
             what, a, b);
    return message;
}

static void at_most(const char *what, double a, double most)
{
    if (!(a <= most)) {
        TEST_FAIL_MESSAGE(where(what, a, most));
    }
}

static uint32_t piece_of(double time_s, uint32_t from)
{
    while (from + 1 < now.p->program.header.piece_count && time_s >= now.p->pieces[from].end_s) {
        from++;
    }
    return from;
}

struct tick {
    double rate, slope, second; /* at its begin, per second and per second squared */
    double time_s;
};

static void check_sample(const struct tick *k, double s)
{
    double t = s * now.h;
    double d[4];
    double rate = k->rate + t * (k->slope + t * k->second / 2);
    double slope = k->slope + t * k->second;
    double time_s = k->time_s + t * (k->rate + t * (k->slope / 2 + t * k->second / 6));
    if (time_s >= (double)now.p->program.header.duration_q32_s / 4294967296.0) {
        return;
    }
    override_program_feed(now.p, piece_of(time_s, now.piece), time_s, d);
    double a = fabs(slope * d[1] + rate * rate * d[2]) / now.p->limit.acceleration;
    double j = fabs(k->second * d[1] + 3 * rate * slope * d[2] + rate * rate * rate * d[3]) /
               now.p->limit.jerk;
    at_most("feed", rate * d[1], now.p->limit.feed * (1 + 1e-9) + 1e-6);
    at_most("acceleration", a, 1 + 1e-6);
    at_most("jerk", j, 1 + 1e-6);
    worst.acceleration = a > worst.acceleration ? a : worst.acceleration;
    worst.jerk = j > worst.jerk ? j : worst.jerk;
}

/* By how much the bounds of the level that is kept best are passed; 1 and below: they are kept. */
static double beyond_levels(const struct override_piece *c, double high, double slope,
                            double second)
{
    double least = 1e30;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        const double worst =
            fmax(high / c->rates[k], fmax(slope / c->slopes[k], second / c->seconds[k]));
        least = fmin(least, worst);
    }
    return least;
}

/* The bounds of every piece that the tick touches hold over the whole of it. */
static void check_bounds(const struct tick *k, double end_s)
{
    double last = k->slope + now.h * k->second;
    double high = k->rate + fmax(0, now.h * (k->slope + last) / 2);
    if (k->slope > 0 && last < 0) {
        high = k->rate - k->slope * k->slope / (2 * k->second);
    }
    for (uint32_t i = now.piece; i < now.p->program.header.piece_count; i++) {
        const struct override_piece *c = &now.p->pieces[i];
        if (i > now.piece && c->start_s >= end_s) {
            break;
        }
        at_most("factor", high, c->rates[PROGRAM_LEVEL_FULL] * (1 + 1e-12));
        at_most("bounds of a level",
                beyond_levels(c, high, fmax(fabs(k->slope), fabs(last)), fabs(k->second)),
                1 + 1e-12);
    }
}

/* A tick of the plan after one of the plan. */
static void check_motion(const struct override_plan *before)
{
    const double scale = 1.0 / 72057594037927936.0; /* 2^-56 */
    struct tick k;
    int64_t rise = now.feed.plan.now.override_q57 - before->now.override_q57 -
                   before->now.slope_q56 - now.feed.plan.now.slope_q56;
    at_most("rate is the sum of its slopes", (double)llabs(rise), 1);
    k.rate = (double)before->now.override_q57 * scale / 2;
    k.slope = (double)before->now.slope_q56 * scale / now.h;
    k.second =
        (double)(now.feed.plan.now.slope_q56 - before->now.slope_q56) * scale / (now.h * now.h);
    k.time_s = now.time_s;
    double way = now.h * (k.rate + now.h * (k.slope / 2 + now.h * k.second / 6));
    uint64_t time = feed_override_time_q42(&now.feed);
    double moved = (double)(time - now.time_q42) / 4398046511104.0;
    if (now.feed.state != FEED_ENDED) {
        at_most("program time", fabs(moved - way), 3.5e-13);
    } else {
        at_most("program time at the end", moved, way + 3.5e-13);
    }
    at_most("rate below 2", k.rate, 2);
    at_most("rate not below 0", -k.rate, 0);
    check_bounds(&k, now.time_s + way);
    for (int n = 0; n <= 4; n++) {
        check_sample(&k, n / 4.0);
    }
}

/* The setpoint is at the arc length of the program time, or of the brake. */
static void check_arc(double arc)
{
    double d[4];
    const uint64_t time = feed_override_time_q42(&now.feed);
    now.time_q42 = time;
    now.time_s = (double)time / 4398046511104.0;
    if (now.feed.phase == BRAKE || (now.feed.phase == REST && now.feed.found == 0)) {
        const struct path_state *at = &now.feed.brake.at;
        at_most("arc length of the brake",
                fabs((double)(at->arc_length_q40_mm - now.point.arc_length_q40_mm)), 1);
        return;
    }
    now.piece = piece_of(now.time_s, now.piece);
    override_program_feed(now.p, now.piece, now.time_s, d);
    at_most("arc length", fabs(arc - d[0]), 3e-10);
}

static void check_differences(void)
{
    const double more = now.fault ? 2 : 1; /* codes of a fault stop are 8 steps higher: twice */
    const struct override_limits *limit = &now.p->limit;
    struct override_differences d;
    if (!override_trace_add(&now.trace, now.point.arc_length_q40_mm, now.h, &d)) {
        return;
    }
    at_most("jerk by differences", d.jerk, more * limit->jerk * (1 + 1e-6) + 1.0);
    at_most("acceleration by differences", d.acceleration,
            more * limit->acceleration * (1 + 1e-6) + 1e-3);
    at_most("never backwards", d.back_mm, 2e-10);
    worst.difference = fmax(worst.difference, d.jerk / limit->jerk / more);
}

/* Setpoints lie on the curve. */
static void check_point(void)
{
    const double arc = (double)now.point.arc_length_q40_mm / 1099511627776.0;
    check_arc(arc);
    if (now.line) {
        at_most("on the line",
                fabs((double)(now.point.position_q40[0] - now.point.arc_length_q40_mm)), 400);
        at_most("on the line", fabs((double)now.point.position_q40[1]), 0);
    } else if (now.ticks % 16u == 0 || now.feed.state == FEED_ENDED) {
        interpolator_seek(&now.exact, now.time_q42 >> 10);
        at_most("on the curve", override_distance_q40(&now.exact, &now.point), 1.1e6);
    }
    check_differences();
}

static enum feed_state expected_state(void)
{
    if (now.feed.state == FEED_ENDED) {
        TEST_ASSERT_TRUE(now.time_q42 == now.p->program.header.duration_q32_s << 10);
        return FEED_ENDED;
    }
    if (now.wanted == RUN) {
        return FEED_RUNNING;
    }
    if (now.feed.phase == REST) {
        return now.wanted == STOP ? FEED_STOPPED : FEED_HELD;
    }
    return now.wanted == STOP ? FEED_STOPPING : FEED_HOLDING;
}

static int over(void)
{
    return now.feed.state == FEED_ENDED || now.feed.state == FEED_STOPPED;
}

static int at_rest(void)
{
    return over() || now.feed.state == FEED_HELD;
}

static void tick(void)
{
    const struct feed_override before = now.feed;
    const int rested = at_rest();
    TEST_ASSERT_EQUAL_INT(0, feed_override_next(&now.feed, &now.interp, &now.point));
    if (before.plan.started && before.phase == PLAN && now.feed.phase == PLAN && !rested) {
        check_motion(&before.plan);
    }
    check_point();
    const enum feed_state expected = expected_state();
    if (feed_override_state(&now.feed) != expected) {
        TEST_FAIL_MESSAGE(
            where("state, and the expected one", feed_override_state(&now.feed), expected));
    }
    if (feed_override_late(&now.feed)) {
        TEST_FAIL_MESSAGE(where("late", now.bound_us, 0));
    }
    /* a program that ends before its brake would is judged by feed_override_late */
    if (!rested && at_rest() && now.wanted != RUN && now.bound_us != 0 &&
        now.feed.state != FEED_ENDED) {
        at_most("bound", (double)(now.ticks + 1u - now.asked) * now.h * 1e6, now.bound_us);
        worst.of_bound =
            fmax(worst.of_bound, (double)(now.ticks + 1u - now.asked) * now.h * 1e6 / now.bound_us);
    }
    worst.saturated += feed_override_saturated(&now.feed) ? 1u : 0u;
    now.ticks++;
    worst.ticks++;
}

/* The bound counts from here, where waiting happens at rate 1. */
static void ask(enum program_stop_kind kind)
{
    now.asked = now.ticks;
    now.bound_us = 0;
    if (now.feed.phase == PLAN && now.feed.plan.now.override_q57 == OVERRIDE_ONE &&
        now.feed.plan.now.slope_q56 == 0) {
        now.bound_us = feed_override_bound_us(&now.feed, kind);
    }
}

static void stop(uint64_t *random)
{
    if (golden_random(random) % 2u == 0) {
        if (now.wanted == RUN) {
            ask(PROGRAM_STOP_HOLD);
        }
        feed_override_stop(&now.feed);
    } else {
        if (!over() && !now.fault) {
            ask(PROGRAM_STOP_FAULT);
        }
        now.fault = 1;
        feed_override_fault_stop(&now.feed);
    }
    now.wanted = STOP;
}

static void command(uint64_t *random)
{
    switch (golden_random(random) % 8u) {
    case 0:
    case 1:
        if (now.wanted == RUN) {
            ask(PROGRAM_STOP_HOLD);
        }
        feed_override_hold(&now.feed);
        now.wanted = now.wanted == RUN ? HOLD : now.wanted;
        break;
    case 2:
    case 3:
        feed_override_resume(&now.feed);
        now.wanted = now.wanted == HOLD ? RUN : now.wanted;
        break;
    case 4:
        if (golden_random(random) % 2u == 0) {
            stop(random);
        }
        break;
    case 5:
        now.percent = 100u * (uint32_t)(golden_random(random) % 3u);
        feed_override_set(&now.feed, now.percent);
        break;
    default:
        now.percent = (uint32_t)(golden_random(random) % 201u);
        feed_override_set(&now.feed, now.percent);
        break;
    }
}

/* Draws a program and its limits, and prepares it: all that a group of cases shares. */
static void choose(uint64_t random)
{
    unsigned kind = (unsigned)(golden_random(&random) % 4u);
    unsigned period = (unsigned)(golden_random(&random) % 4u);
    unsigned which = (unsigned)golden_random(&random);
    chosen.line = golden_random(&random) % 4u != 0;
    period = kind < 2 || !chosen.line ? 0 : period;
    chosen.period_us = 1000u << period;
    chosen.p = chosen.line ? &bank[period][which % LINES] : &goldens[which % GOLDENS];
    override_program_limits(chosen.p, &random);
    golden_discard(&fixed);
    golden_precompute(&fixed, &chosen.p->program, KERNEL_FIXED);
    if (!chosen.line) {
        golden_discard(&exact);
        golden_precompute(&exact, &chosen.p->program, KERNEL_DOUBLE);
    }
}

/* At the start, or at any instant, from standstill or already at override 1. */
static void begin(uint64_t *random)
{
    uint64_t duration_q42 = chosen.p->program.header.duration_q32_s << 10;
    uint64_t from = golden_random(random) % 4u == 0 ? 0 : golden_random(random) % duration_q42;
    unsigned number = now.number;
    memset(&now, 0, sizeof now);
    now.number = number;
    now.p = chosen.p;
    now.line = chosen.line;
    now.h = chosen.period_us * 1e-6;
    now.percent = 100;
    interpolator_begin(&now.interp, &fixed.program);
    if (!now.line) {
        interpolator_begin(&now.exact, &exact.program);
    }
    feed_override_begin(&now.feed, &fixed.program, chosen.period_us, from);
    interpolator_seek(&now.interp, from >> 10);
    if (from > 0 && golden_random(random) % 2u == 0) {
        now.feed.plan.now.override_q57 = OVERRIDE_ONE;
    }
}

/* Whatever the commands were, the command is executed in the time that the least bounds take. */
static void finish(void)
{
    struct ramp_ticks down;
    struct ramp_limits limits;
    int64_t ticks = 10000;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        override_limits_of(&limits, &now.feed.plan.guaranteed, k, now.feed.clock.period_log2);
        override_ticks_of(&down, &limits, k == PROGRAM_LEVEL_FULL ? OVERRIDE_MOST : OVERRIDE_ONE);
        ticks += 4 * 2 * ((int64_t)down.rise + down.half);
    }
    int64_t wanted = OVERRIDE_ONE / 100 * now.percent;
    wanted = wanted < now.feed.plan.guaranteed_q57 ? wanted : now.feed.plan.guaranteed_q57;
    for (int64_t i = 0; i < ticks && !over(); i++) {
        int64_t rate = now.feed.plan.now.override_q57;
        int still = now.feed.plan.now.slope_q56 == 0 && now.feed.phase == PLAN;
        if (now.wanted == RUN
                ? still && rate >= wanted - 100 &&
                      (now.percent * (OVERRIDE_ONE / 100) > now.feed.plan.guaranteed_q57 ||
                       rate <= wanted + 100)
                : now.feed.state == FEED_HELD && now.feed.found) {
            return;
        }
        tick();
    }
    TEST_ASSERT_TRUE_MESSAGE(
        over(),
        where("never there", (double)now.feed.plan.now.override_q57 / OVERRIDE_ONE, now.percent));
}

static void run_to_the_end(void)
{
    feed_override_resume(&now.feed);
    now.wanted = now.wanted == HOLD ? RUN : now.wanted;
    if (now.percent < 50) {
        feed_override_set(&now.feed, now.percent = 50);
    }
    for (unsigned i = 0; i < 100000u && !over(); i++) {
        tick();
    }
    TEST_ASSERT_TRUE_MESSAGE(over(), where("no end", now.time_s, 0));
}

static void check_over(void)
{
    int ended = now.feed.state == FEED_ENDED;
    const struct interpolator_point before = now.point;
    for (int i = 0; i < 4; i++) {
        tick();
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &now.point, sizeof before);
    TEST_ASSERT_EQUAL_UINT32(0, feed_override_actual_q30(&now.feed));
    TEST_ASSERT_TRUE(feed_override_feed_q32(&now.feed) == 0);
    if (ended) {
        TEST_ASSERT_TRUE(now.point.arc_length_q40_mm == now.p->program.header.length_q40_mm);
        TEST_ASSERT_TRUE(now.point.position_q40[0] == now.interp.end.position_q40[0] &&
                         now.point.position_q40[1] == now.interp.end.position_q40[1]);
    }
}

static void run_case(uint64_t seed)
{
    uint64_t random = seed;
    begin(&random);
    unsigned commands = 1u + (unsigned)(golden_random(&random) % 6u);
    for (unsigned i = 0; i < commands && !over(); i++) {
        unsigned wait = (unsigned)(golden_random(&random) % (3u << golden_random(&random) % 7u));
        command(&random);
        for (unsigned k = 0; k < wait && !over(); k++) {
            tick();
        }
    }
    finish();
    worst.held += now.feed.state == FEED_HELD;
    if (golden_random(&random) % 16u == 0) {
        run_to_the_end();
    }
    if (over()) {
        check_over();
    }
    worst.over += over() ? 1u : 0u;
    worst.ended += now.feed.state == FEED_ENDED;
    worst.stopped += now.feed.state == FEED_STOPPED;
}

static unsigned setting(const char *name, unsigned otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? (unsigned)strtoul(text, NULL, 10) : otherwise;
}

static void make_programs(uint64_t seed)
{
    for (uint32_t i = 0; i < 4u * LINES; i++) {
        struct override_program *p = &bank[i / LINES][i % LINES];
        struct program_limits limits = golden_no_limits();
        struct program_fault fault;
        override_program_random(p, 1000u << i / LINES, &seed);
        override_program_limits(p, &seed);
        int code = program_check(&p->program, &limits, &fault);
        if (code != 0) {
            snprintf(message, sizeof message, "program %u: %s at %u", (unsigned)i,
                     program_error_text(code), (unsigned)fault.index);
            TEST_FAIL_MESSAGE(message);
        }
    }
    for (unsigned i = 0; i < GOLDENS; i++) {
        override_program_golden(&goldens[i], GOLDEN[i]);
    }
}

static void test_any_commands_at_any_instant(void)
{
    unsigned cases = setting("HODOGRAPH_CASES", CASES);
    uint64_t seed = setting("HODOGRAPH_SEED", 1);
    make_programs(seed);
    const unsigned first = setting("HODOGRAPH_FIRST", 0);
    for (unsigned i = first; i < cases; i++) {
        if (i == first || i % RUNS == 0) {
            choose(~(seed * 0x100000001u + i / RUNS));
        }
        now.number = i;
        run_case(seed * 0x100000001u + i);
    }
    printf("%u cases, %.3g ticks: acceleration %.6f, jerk %.6f of the limits (by differences "
           "%.6f); stops %.3f of their bounds; %u "
           "ended, %u stopped, %u held; %u ticks saturated\n",
           cases, (double)worst.ticks, worst.acceleration, worst.jerk, worst.difference,
           worst.of_bound, worst.ended, worst.stopped, worst.held, worst.saturated);
    TEST_ASSERT_TRUE(cases < 1000u || (worst.ended > 0 && worst.stopped > 0 && worst.held > 0 &&
                                       worst.saturated > 0 && worst.jerk > 0.9));
    for (uint32_t i = 0; i < 4u * LINES; i++) {
        override_program_close(&bank[i / LINES][i % LINES]);
    }
    for (unsigned i = 0; i < GOLDENS; i++) {
        override_program_close(&goldens[i]);
    }
    golden_discard(&fixed);
    golden_discard(&exact);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_any_commands_at_any_instant);
    return UNITY_END();
}
