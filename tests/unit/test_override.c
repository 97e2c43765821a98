/* SPDX-License-Identifier: MIT */
/*
 * Property test of the timebase: random programs, instants and sequences of commands. Each tick is checked against what
 * docs/protocol.md 1.3 and docs/numerics.md sections 7 and 12 promise: bounds of every piece touched, feed, acceleration
 * and jerk on the path (from the rate and F, and by differences of the setpoints), setpoints on the curve, states, end.
 *
 * HODOGRAPH_CASES: how many; HODOGRAPH_SEED: another sequence.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/interp.h"
#include "core/program_time.h"
#include "core/timebase.h"
#include "golden.h"
#include "override_program.h"
#include "unity.h"

#ifdef __SANITIZE_ADDRESS__
#define CASES 10000u
#else
#define CASES 100000u
#endif
#define LINES 24u

static const char *const GOLDEN[] = {"alpha_minimax.hdgp", "alpha_exponential.hdgp",
                                     "heart_minimax.hdgp", "line.hdgp", "star_minimax.hdgp"};
#define GOLDENS (sizeof GOLDEN / sizeof *GOLDEN)

enum wish { RUN, HOLD, STOP };

static struct override_program bank[4][LINES];
static struct override_program goldens[GOLDENS];

static struct {
    const struct override_program *p;
    struct timebase tb;
    struct interp interp;
    struct interp exact;
    struct interp_point point;
    double h;
    enum wish wish;
    uint32_t percent;
    int line;
    unsigned number;
    unsigned known; /* setpoints in `arc` */
    double arc[4];
    uint64_t time_q42;
    double time_s;
    uint32_t piece;
    double worst_acceleration, worst_jerk; /* parts of the limits */
    unsigned ticks;
} now;

static struct {
    double acceleration, jerk, difference;
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
        at_most("factor", high, c->factor * (1 + 1e-12));
        at_most("rate", fmax(fabs(k->slope), fabs(last)), c->rate * (1 + 1e-12));
        at_most("second", fabs(k->second), c->second * (1 + 1e-12));
    }
}

static void check_motion(const struct timebase *before)
{
    const double scale = 1.0 / 72057594037927936.0; /* 2^-56 */
    struct tick k;
    int64_t rise =
        now.tb.now.rate_q57 - before->now.rate_q57 - before->now.slope_q56 - now.tb.now.slope_q56;
    at_most("rate is the sum of its slopes", (double)llabs(rise), 1);
    k.rate = (double)before->now.rate_q57 * scale / 2;
    k.slope = (double)before->now.slope_q56 * scale / now.h;
    k.second = (double)(now.tb.now.slope_q56 - before->now.slope_q56) * scale / (now.h * now.h);
    k.time_s = now.time_s;
    double way = now.h * (k.rate + now.h * (k.slope / 2 + now.h * k.second / 6));
    uint64_t time = timebase_time_q42(&now.tb);
    double moved = (double)(time - now.time_q42) / 4398046511104.0;
    if (now.tb.state != TIMEBASE_ENDED) {
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

/* Setpoints lie on the curve, at the arc length of the program time. */
static void check_point(void)
{
    double d[4];
    uint64_t time = timebase_time_q42(&now.tb);
    int result = interp_at_q42(&now.interp, time, &now.point);
    now.time_q42 = time;
    now.time_s = (double)time / 4398046511104.0;
    TEST_ASSERT_TRUE_MESSAGE(result >= 0, where("interpolated", result, 0));
    now.piece = piece_of(now.time_s, now.piece);
    override_program_feed(now.p, now.piece, now.time_s, d);
    double arc = (double)now.point.arc_length_q40_mm / 1099511627776.0;
    at_most("arc length", fabs(arc - d[0]), 2e-10);
    if (now.line) {
        at_most("on the line", fabs((double)(now.point.x_q40_mm - now.point.arc_length_q40_mm)),
                400);
        at_most("on the line", fabs((double)now.point.y_q40_mm), 0);
    } else if (now.ticks % 16u == 0 || now.tb.state == TIMEBASE_ENDED) {
        struct interp_point exact;
        interp_seek(&now.exact, time >> 10);
        interp_at_q42(&now.exact, time, &exact);
        at_most("on the curve",
                hypot((double)(exact.x_q40_mm - now.point.x_q40_mm),
                      (double)(exact.y_q40_mm - now.point.y_q40_mm)),
                1.1e6);
    }
    memmove(now.arc, now.arc + 1, 3 * sizeof *now.arc);
    now.arc[3] = arc;
    if (++now.known >= 4) {
        double jerk = fabs(now.arc[3] - 3 * now.arc[2] + 3 * now.arc[1] - now.arc[0]) /
                      (now.h * now.h * now.h);
        at_most("jerk by differences", jerk, now.p->limit.jerk * (1 + 1e-6) + 1.0);
        worst.difference = fmax(worst.difference, jerk / now.p->limit.jerk);
    }
}

static enum timebase_state expected_state(void)
{
    int still = now.tb.now.rate_q57 == 0 && now.tb.now.slope_q56 == 0;
    if (timebase_time_q42(&now.tb) == now.p->program.header.duration_q32_s << 10) {
        return TIMEBASE_ENDED;
    }
    if (now.wish == STOP) {
        return still ? TIMEBASE_STOPPED : TIMEBASE_STOPPING;
    }
    return now.wish == RUN ? TIMEBASE_RUNNING : still ? TIMEBASE_HELD : TIMEBASE_HOLDING;
}

static int over(void)
{
    return now.tb.state == TIMEBASE_ENDED || now.tb.state == TIMEBASE_STOPPED;
}

static void tick(void)
{
    struct timebase before = now.tb;
    timebase_step(&now.tb);
    if (before.started && before.state != TIMEBASE_ENDED && before.state != TIMEBASE_STOPPED) {
        check_motion(&before);
    }
    check_point();
    TEST_ASSERT_EQUAL_INT_MESSAGE(expected_state(), timebase_state(&now.tb),
                                  where("state", now.wish, 0));
    worst.saturated += timebase_saturated(&now.tb) ? 1u : 0u;
    now.ticks++;
    worst.ticks++;
}

static void command(uint64_t *random)
{
    switch (golden_random(random) % 8u) {
    case 0:
    case 1:
        timebase_hold(&now.tb);
        now.wish = now.wish == RUN ? HOLD : now.wish;
        break;
    case 2:
    case 3:
        timebase_resume(&now.tb);
        now.wish = now.wish == HOLD ? RUN : now.wish;
        break;
    case 4:
        if (golden_random(random) % 4u == 0) {
            timebase_stop(&now.tb);
            now.wish = STOP;
        }
        break;
    case 5:
        now.percent = 100u * (uint32_t)(golden_random(random) % 3u);
        timebase_override(&now.tb, now.percent);
        break;
    default:
        now.percent = (uint32_t)(golden_random(random) % 201u);
        timebase_override(&now.tb, now.percent);
        break;
    }
}

/* At the start, or at any instant, from rest or already at rate 1. */
static void begin(struct override_program *p, int line, uint32_t period_us, uint64_t *random)
{
    uint64_t duration_q42 = p->program.header.duration_q32_s << 10;
    uint64_t from = golden_random(random) % 4u == 0 ? 0 : golden_random(random) % duration_q42;
    unsigned number = now.number;
    memset(&now, 0, sizeof now);
    now.number = number;
    now.p = p;
    now.line = line;
    now.h = period_us * 1e-6;
    now.percent = 100;
    override_program_limits(p, random);
    interp_begin(&now.interp, &p->program, INTERP_FIXED);
    interp_begin(&now.exact, &p->program, INTERP_DOUBLE);
    timebase_begin_at(&now.tb, &p->program, period_us, from);
    interp_seek(&now.interp, from >> 10);
    if (from > 0 && golden_random(random) % 2u == 0) {
        now.tb.now.rate_q57 = RATE_ONE;
    }
}

/* Whatever the commands were, the wish is fulfilled in the time that the least bounds take. */
static void finish(void)
{
    struct rate_ticks down;
    rate_ticks_of(&down, &now.tb.least, RATE_MOST);
    int64_t ticks = 4 * 2 * ((int64_t)down.rise + down.half) + 100;
    int64_t wanted = RATE_ONE / 100 * now.percent;
    wanted = wanted < now.tb.least_q57 ? wanted : now.tb.least_q57;
    for (int64_t i = 0; i < ticks && !over(); i++) {
        int64_t rate = now.tb.now.rate_q57;
        int still = now.tb.now.slope_q56 == 0;
        if (now.wish == RUN
                ? still && rate >= wanted - 100 &&
                      (now.percent * (RATE_ONE / 100) > now.tb.least_q57 || rate <= wanted + 100)
                : still && rate == 0) {
            return;
        }
        tick();
    }
    TEST_ASSERT_TRUE_MESSAGE(
        over(), where("never there", (double)now.tb.now.rate_q57 / RATE_ONE, now.percent));
}

static void run_to_the_end(void)
{
    timebase_resume(&now.tb);
    now.wish = now.wish == HOLD ? RUN : now.wish;
    if (now.percent < 50) {
        timebase_override(&now.tb, now.percent = 50);
    }
    for (unsigned i = 0; i < 100000u && !over(); i++) {
        tick();
    }
    TEST_ASSERT_TRUE_MESSAGE(over(), where("no end", now.time_s, 0));
}

static void check_over(void)
{
    int ended = now.tb.state == TIMEBASE_ENDED;
    uint64_t time = timebase_time_q42(&now.tb);
    for (int i = 0; i < 4; i++) {
        tick();
    }
    TEST_ASSERT_TRUE(time == timebase_time_q42(&now.tb));
    TEST_ASSERT_EQUAL_UINT32(0, timebase_rate_q30(&now.tb));
    if (ended) {
        TEST_ASSERT_TRUE(now.point.arc_length_q40_mm == now.p->program.header.length_q40_mm);
        TEST_ASSERT_TRUE(now.point.x_q40_mm == now.interp.end.x_q40_mm &&
                         now.point.y_q40_mm == now.interp.end.y_q40_mm);
    }
}

static void run_case(uint64_t seed)
{
    uint64_t random = seed;
    unsigned kind = (unsigned)(golden_random(&random) % 4u);
    unsigned period = (unsigned)(golden_random(&random) % 4u);
    unsigned which = (unsigned)golden_random(&random);
    int line = golden_random(&random) % 4u != 0;
    period = kind < 2 || !line ? 0 : period;
    begin(line ? &bank[period][which % LINES] : &goldens[which % GOLDENS], line, 1000u << period,
          &random);
    unsigned commands = 1u + (unsigned)(golden_random(&random) % 6u);
    for (unsigned i = 0; i < commands && !over(); i++) {
        unsigned wait = (unsigned)(golden_random(&random) % (3u << golden_random(&random) % 7u));
        command(&random);
        for (unsigned k = 0; k < wait && !over(); k++) {
            tick();
        }
    }
    finish();
    worst.held += now.tb.state == TIMEBASE_HELD;
    if (golden_random(&random) % 16u == 0) {
        run_to_the_end();
    }
    if (over()) {
        check_over();
    }
    worst.over += over() ? 1u : 0u;
    worst.ended += now.tb.state == TIMEBASE_ENDED;
    worst.stopped += now.tb.state == TIMEBASE_STOPPED;
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
    for (unsigned i = setting("HODOGRAPH_FIRST", 0); i < cases; i++) {
        now.number = i;
        run_case(seed * 0x100000001u + i);
    }
    printf("%u cases, %.3g ticks: acceleration %.6f, jerk %.6f of the limits (by differences "
           "%.6f); %u "
           "ended, %u stopped, %u held; %u ticks saturated\n",
           cases, (double)worst.ticks, worst.acceleration, worst.jerk, worst.difference,
           worst.ended, worst.stopped, worst.held, worst.saturated);
    TEST_ASSERT_TRUE(cases < 1000u || (worst.ended > 0 && worst.stopped > 0 && worst.held > 0 &&
                                       worst.saturated > 0 && worst.jerk > 0.9));
    for (uint32_t i = 0; i < 4u * LINES; i++) {
        override_program_close(&bank[i / LINES][i % LINES]);
    }
    for (unsigned i = 0; i < GOLDENS; i++) {
        override_program_close(&goldens[i]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_any_commands_at_any_instant);
    return UNITY_END();
}
