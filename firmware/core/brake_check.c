/* SPDX-License-Identifier: MIT */
/* Implements core/brake_check.h (see there): the proof that path stops keep the limits of the path axes. Used by
 * `hodograph verify` through host_tools/hodograph/native; a controller does not call it. Main loop of a host. Changes
 * only its struct; no I/O. */
#include "core/brake_check.h"

#include "core/qmath.h"
#include "core/stop_check.h"

#define STEPS 16 /* of a path stop, about */
/* of a path stop, until the remaining states must be within the limits as a whole */
#define MOST_STEPS        160
#define MOST_HALVINGS     3     /* of a step */
#define MOST_PARTS        14    /* of a piece at a time */
#define MOST_EVALUATIONS  3000  /* of stretches of path stops, for a piece and kind, */
#define EVALUATIONS_PER_S 30000 /* and more for a long piece */
#define LOW_RATES         4     /* halvings of the rate of the lowest level, each by itself */
#define PIECE_SLACK_Q40   ((int64_t)1 << 26) /* by which a piece may go back: 2^-14 mm */
#define Q40_BITS          62

static const struct real zero = {0, 0};

/* mm, s */
struct numbers {
    struct real down;
    struct real deep;
    struct real up;
};

/* All states between bounds: arc length, speed, acceleration. */
struct states {
    int64_t low_q40_mm;
    int64_t high_q40_mm;
    struct span v;
    struct span a;
};

/* Instants of a piece (0 to 1), rates of program time and their slopes. */
struct part {
    struct span u;
    struct span rate;
    struct span slope;
};

/* The path stops from all states of a part, at one time. */
struct flow {
    const struct numbers *own;
    struct states at;
    struct span begin;  /* accelerations at the start, */
    struct real least;  /* and the least at any time; */
    struct real lowest; /* the least up to now */
    struct real slow;   /* least jerk of the release phase; 0: not known */
    struct real period_s;
    struct span late_s; /* when the acceleration begins to fall: at least, at most */
    struct real time_s;
};

/* --- Numbers --- */

static struct real real_min(struct real a, struct real b)
{
    return real_less(b, a) != 0 ? b : a;
}

static struct real real_root(struct real a)
{
    if (a.m <= 0) {
        return zero;
    }
    const int32_t up = (a.e & 1) != 0 ? 31 : 32;
    return real_make((int64_t)qmath_root((uint64_t)a.m << up), (a.e - up) / 2);
}

static struct real square(struct real a)
{
    return real_mul(a, a);
}

/* In 2^-40, rounded down and held at +-2^Q40_BITS. */
static int64_t q40_of(struct real a)
{
    const int32_t up = a.e + 40;
    if (a.m == 0 || up < -40) {
        return a.m < 0 ? -1 : 0;
    }
    if (up > 30) {
        return a.m < 0 ? -((int64_t)1 << Q40_BITS) : (int64_t)1 << Q40_BITS;
    }
    return up >= 0 ? (int64_t)a.m * ((int64_t)1 << up) : (int64_t)a.m >> (up > -32 ? -up : 32);
}

/* Thousandths, rounded up, held at 2^32. */
static uint64_t thousandths(struct real a)
{
    const int64_t q40 = q40_of(real_times(a, 1000));
    const int64_t most = (int64_t)1 << 32;
    return a.m <= 0 ? 0u : (uint64_t)qmath_lesser((q40 >> 40) + 1, most);
}

static void read_numbers(struct numbers *out, const struct program_stop *stop)
{
    out->down = real_make((int64_t)program_number(stop->jerk_down), -18);
    out->deep = real_make((int64_t)program_number(stop->deceleration), -24);
    out->up = real_make((int64_t)program_number(stop->jerk_up), -18);
}

/* The greatest and least of products of two spans. */
static struct span product(const struct span *a, const struct span *b)
{
    struct real ends[4];
    ends[0] = real_mul(a->low, b->low);
    ends[1] = real_mul(a->low, b->high);
    ends[2] = real_mul(a->high, b->low);
    ends[3] = real_mul(a->high, b->high);
    struct span out = {ends[0], ends[0]};
    for (int i = 1; i < 4; i++) {
        out.low = real_min(out.low, ends[i]);
        out.high = real_max(out.high, ends[i]);
    }
    return out;
}

static struct span sum(struct span a, struct span b)
{
    const struct span out = {real_add(a.low, b.low), real_add(a.high, b.high)};
    return out;
}

static struct span times(struct span a, int32_t n)
{
    const struct span out = {real_times(a.low, n), real_times(a.high, n)};
    return out;
}

/* --- Limits --- */

static int within(struct span value, struct real limit)
{
    return limit.m == 0 || real_less(limit, real_max(real_negative(value.low), value.high)) == 0;
}

/* With derivatives c1, c2, c3 of an axis by arc length: velocity c1 v, acceleration c2 v^2 + c1 a, jerk c3 v^3 + 3 c2 v
 * a + c1 j. All combinations of states and jerks, on all of their stretch. */
static int keeps_on(const struct brake_check *check, const struct path_stretch *path,
                    const struct states *at, struct span jerk)
{
    const struct span v2 = {square(at->v.low), square(at->v.high)};
    const struct span v3 = {real_mul(v2.low, at->v.low), real_mul(v2.high, at->v.high)};
    const struct span va = times(product(&at->v, &at->a), 3);
    int kept = 1;
    for (uint32_t axis = 0; axis < check->bounds.program->header.axis_count && kept != 0; axis++) {
        const struct span *c = path->of[axis];
        const struct real *limit = check->limit.of[axis];
        kept = within(product(&c[0], &at->v), limit[VELOCITY]) &&
               within(sum(product(&c[1], &v2), product(&c[0], &at->a)), limit[ACCELERATION]) &&
               within(sum(sum(product(&c[2], &v3), product(&c[1], &va)), product(&c[0], &jerk)),
                      limit[JERK]);
    }
    return kept;
}

static void path_of(struct brake_check *check, const struct states *at, struct path_stretch *path)
{
    check->evaluations++;
    path_bounds_of(&check->bounds, check->hint, at->low_q40_mm, at->high_q40_mm, path);
}

/* --- The path stops from all states of a part --- */

/* The least deceleration at which the release phase can begin, for a speed v: b^2 c + 4 T b >= v with
 * c = 1 / (2 j1) + 1.016 / (2 j2). */
static struct real least_depth(const struct flow *flow, struct real v)
{
    const struct real half = real_make(1, -1);
    const struct real c =
        real_add(real_div(half, flow->own->down), real_div(real_make(1041, -11), flow->own->up));
    const struct real late = real_scale(flow->period_s, 2);
    const struct real root = real_root(real_add(square(late), real_scale(real_mul(c, v), 2)));
    return real_div(real_scale(v, 1), real_add(late, root));
}

/* The least jerk of the release phase, of one that begins at the least depth. */
static struct real least_release(const struct flow *flow)
{
    if (flow->at.v.low.m == 0) {
        return zero;
    }
    const struct real depth = real_min(least_depth(flow, flow->at.v.low), flow->own->deep);
    const struct real tick = real_mul(flow->own->up, flow->period_s);
    const struct real n = real_div(depth, tick);
    if (real_less(n, real_make(4, 0)) != 0) {
        return zero;
    }
    const struct real steady = real_div(real_sub(n, real_make(2, 0)), real_add(n, real_make(1, 0)));
    const struct real most = real_add(real_make(1041, -10), real_div(real_times(tick, 5), depth));
    return real_div(real_mul(flow->own->up, steady), most);
}

/* The speed that the jerk of onset makes in a tick, times 2: a path stop whose last tick before the release phase has
 * no jerk may lose less speed by this much. */
static struct real tick_change(const struct flow *flow)
{
    return real_mul(flow->own->down, square(flow->period_s));
}

/* In the first tick an acceleration above 0 falls, as far as 0, and one below stays. */
static void set_late(struct flow *flow)
{
    const struct real tick = real_mul(flow->own->down, flow->period_s);
    flow->late_s.low = flow->begin.high.m > 0 ? zero : flow->period_s;
    flow->late_s.high = real_less(flow->begin.low, tick) != 0 ? flow->period_s : zero;
}

static void flow_begin(struct flow *flow, const struct brake_check *check,
                       const struct numbers *own, const struct states *from)
{
    const struct real deepest =
        real_negative(real_root(real_scale(real_mul(own->up, from->v.high), 1)));
    flow->own = own;
    flow->at = *from;
    flow->at.a.low = real_max(from->a.low, deepest); /* below, no path stop begins */
    flow->at.a.high = real_max(from->a.high, flow->at.a.low);
    flow->begin = flow->at.a;
    flow->least = real_min(real_negative(own->deep), flow->begin.low);
    flow->lowest = real_min(flow->begin.low, zero);
    flow->period_s = check->period_s;
    set_late(flow);
    flow->at.v.high = real_add(flow->at.v.high, real_scale(tick_change(flow), -1));
    flow->time_s = zero;
    flow->slow = least_release(flow);
}

/* Accelerations of the onset at a time: those of the path stop that begins with the greatest one and falls late, */
static struct real onset_high(const struct flow *flow, struct real time_s)
{
    const struct real since = real_max(real_sub(time_s, flow->late_s.high), zero);
    return real_max(real_sub(flow->begin.high, real_mul(flow->own->down, since)),
                    real_negative(flow->own->deep));
}

/* and with the least one at once. */
static struct real onset_low(const struct flow *flow, struct real time_s)
{
    const struct real since = real_max(real_sub(time_s, flow->late_s.low), zero);
    return real_max(real_sub(flow->begin.low, real_mul(flow->own->down, since)), flow->least);
}

/* Acceleration of a release phase with one jerk, at the root of the speed. */
static struct real release(struct real jerk, struct real root_v)
{
    return real_negative(real_mul(real_root(real_scale(jerk, 1)), root_v));
}

/* The root of the speed a time later, in such a release phase. */
static struct real released(struct real jerk, struct real root_v, struct real step_s)
{
    const struct real less = real_mul(real_root(real_scale(jerk, -1)), step_s);
    return real_max(real_sub(root_v, less), zero);
}

/* j h^2 / 8 */
static struct real bulge(struct real jerk, struct real step_s)
{
    return real_scale(real_mul(jerk, square(step_s)), -3);
}

static struct real mean(struct real a, struct real b)
{
    return real_scale(real_add(a, b), -1);
}

/* The greatest speed a time later: no path stop loses less than the slowest onset or the slowest release. */
static struct real speed_high(const struct flow *flow, struct real step_s)
{
    const struct real v = flow->at.v.high;
    const struct real root = real_root(v);
    const struct real root_later = released(flow->slow, root, step_s);
    const struct real onset = onset_high(flow, flow->time_s);
    const struct real onset_later = onset_high(flow, real_add(flow->time_s, step_s));
    const struct real release_later = release(flow->slow, root_later);
    const int late = real_less(flow->time_s, flow->late_s.high);
    struct real change = real_max(onset, release_later);
    if (real_less(onset_later, release_later) == 0 && late == 0) {
        change = mean(onset, onset_later);
    } else if (real_less(release(flow->slow, root), onset) == 0) {
        return square(root_later);
    }
    return real_max(real_add(v, real_mul(change, step_s)), zero);
}

/* The least: none loses more than the fastest onset, nor than a release phase with all the jerk. */
static struct real speed_low(const struct flow *flow, struct real step_s)
{
    const struct real v = flow->at.v.low;
    const struct real onset = onset_low(flow, flow->time_s);
    const struct real later = onset_low(flow, real_add(flow->time_s, step_s));
    const struct real fallen =
        real_sub(real_add(v, real_mul(mean(onset, later), step_s)), bulge(flow->own->down, step_s));
    return real_max(square(released(flow->own->up, real_root(v), step_s)), fallen);
}

/* None can have come to its release phase: b^2 < 2 j2 (v - 3 T b). */
static int none_releases(const struct flow *flow, const struct states *swept)
{
    const struct real b = real_negative(swept->a.low);
    const struct real three = real_times(real_mul(b, flow->period_s), 3);
    const struct real most = real_scale(real_mul(flow->own->up, real_sub(swept->v.low, three)), 1);
    return b.m <= 0 || real_less(square(b), most) != 0;
}

/* By how much an acceleration may be above that of the onset, in the tick without jerk before the release phase. */
static struct real jerkless_tick(const struct flow *flow, const struct states *swept)
{
    return none_releases(flow, swept) != 0 ? zero : real_mul(flow->own->down, flow->period_s);
}

/* One step on: `swept` are all states during the step. */
static void flow_step(struct flow *flow, struct real step_s, struct states *swept)
{
    const struct span v = flow->at.v;
    const struct real later_s = real_add(flow->time_s, step_s);
    const struct real sixth = real_div(step_s, real_make(6, 0));
    struct states *at = &flow->at;
    at->v.high = speed_high(flow, step_s);
    at->v.low = real_min(speed_low(flow, step_s), at->v.high);
    swept->v.low = real_min(v.low, at->v.low);
    swept->v.high = real_max(v.high, at->v.high);
    if (flow->begin.high.m > 0) {
        swept->v.high = real_add(swept->v.high, bulge(flow->own->down, step_s));
    }
    swept->low_q40_mm = at->low_q40_mm;
    at->high_q40_mm +=
        1 + q40_of(real_mul(step_s, real_add(mean(v.high, at->v.high),
                                             real_mul(real_mul(flow->own->down, step_s), sixth))));
    at->low_q40_mm += qmath_greater(
        0, q40_of(real_mul(step_s, real_sub(mean(v.low, at->v.low),
                                            real_mul(real_mul(flow->own->up, step_s), sixth)))));
    swept->high_q40_mm = at->high_q40_mm;
    swept->a.low =
        real_max(onset_low(flow, later_s), release(flow->own->up, real_root(swept->v.high)));
    swept->a.low = real_max(swept->a.low, flow->least);
    swept->a.high = real_max(real_add(onset_high(flow, flow->time_s), jerkless_tick(flow, swept)),
                             release(flow->slow, real_root(swept->v.low)));
    at->a.low = swept->a.low;
    flow->lowest = real_min(flow->lowest, swept->a.low);
    at->a.high = real_max(onset_high(flow, later_s), release(flow->slow, real_root(at->v.low)));
    flow->time_s = later_s;
}

/* The greatest speed in the release phase at a deceleration up to b: that of the least jerk, or of a phase that began
 * with b1 and at most v1 = b1^2 / (2 j2) 1.016 + 2 T b1, and had at most j2 since. */
static struct real release_speed(const struct flow *flow, struct real b)
{
    const struct real twice_up = real_scale(flow->own->up, 1);
    const struct real most = real_negative(flow->lowest);
    const struct real share = real_mul(square(most), real_make(1, -6));
    const struct real began = real_add(real_div(real_add(square(b), share), twice_up),
                                       real_scale(real_mul(most, flow->period_s), 1));
    const struct real twice_slow = real_scale(flow->slow, 1);
    return twice_slow.m == 0 ? began : real_min(began, real_div(square(b), twice_slow));
}

/* The limits in one step. While the acceleration falls, or is the least, there is no jerk above 0; in the release phase
 * none below, and the speed is low. */
static int step_keeps(struct brake_check *check, const struct flow *flow,
                      const struct states *swept, struct real before_s)
{
    const struct real deep = real_negative(flow->own->deep);
    const int rises = real_less(flow->least, deep);
    const int falls = real_less(deep, onset_high(flow, before_s));
    const struct span onset = {falls != 0 ? real_negative(flow->own->down) : zero,
                               rises != 0 ? flow->own->down : zero};
    const struct span up = {zero, flow->own->up};
    struct states last = *swept;
    struct path_stretch path;
    path_of(check, swept, &path);
    if (keeps_on(check, &path, swept, onset) == 0) {
        return 0;
    }
    if (none_releases(flow, swept) != 0) {
        return 1;
    }
    last.a.high = real_min(last.a.high, zero);
    last.v.high = real_min(last.v.high, release_speed(flow, real_negative(swept->a.low)));
    last.v.low = real_min(last.v.low, last.v.high);
    return real_less(last.v.high, swept->v.low) != 0 || keeps_on(check, &path, &last, up) != 0;
}

/* Bounds of time and distance from here to standstill (core/stop_check). */
static int to_standstill(const struct flow *flow, const struct program_stop *stop,
                         uint32_t period_us, struct real *time_s, int64_t *distance_q40)
{
    struct stop_start from = {.speed_um = thousandths(flow->at.v.high),
                              .rising_um = thousandths(flow->at.a.high)};
    const struct stop_bound bound = stop_curve(&from, stop);
    const uint64_t more_us = (uint64_t)STOP_TICKS * period_us;
    if (bound.distance_um == UINT32_MAX || bound.time_us == UINT32_MAX) {
        return 0;
    }
    const uint64_t more_um = qmath_div_up_u64(from.speed_um * more_us, 1000000u);
    *time_s = real_div(real_make((int64_t)(bound.time_us + more_us), 0), real_make(1000000, 0));
    /* 2^40 / 1000, up */
    *distance_q40 = (int64_t)((bound.distance_um + more_um) * 1099511628u);
    return 1;
}

/* While the acceleration falls to 0 the speed rises: by a^2 / (2 j1), and two ticks. */
static struct real greatest_speed(const struct flow *flow)
{
    const struct real rise = real_max(flow->at.a.high, zero);
    const struct real late = real_scale(real_mul(rise, flow->period_s), 1);
    const struct real falls = real_div(square(rise), real_scale(flow->own->down, 1));
    return real_add(flow->at.v.high, real_add(late, falls));
}

/* The remaining motion of all path stops at once. */
static int remainder_keeps(struct brake_check *check, const struct flow *flow, int64_t distance_q40)
{
    struct states left = flow->at;
    struct path_stretch path;
    struct span jerk = {real_negative(flow->own->down), real_max(flow->own->up, flow->own->down)};
    const struct real rise = real_max(flow->at.a.high, zero);
    if (real_less(flow->least, real_negative(flow->own->deep)) == 0) {
        jerk.high = flow->own->up;
    }
    left.v.high = greatest_speed(flow);
    left.v.low = zero;
    left.a.low = real_max(flow->least, release(flow->own->up, real_root(left.v.high)));
    left.a.high = rise;
    left.high_q40_mm += distance_q40;
    path_of(check, &left, &path);
    return keeps_on(check, &path, &left, jerk);
}

/* Every path stop from these states, until standstill. */
static int brakes_keep(struct brake_check *check, const struct program_stop *stop,
                       const struct numbers *own, const struct states *from)
{
    const uint32_t period_us = check->bounds.program->header.period_us;
    struct flow flow;
    struct real time_s = zero;
    struct real tried = zero;
    int64_t distance_q40 = 0;
    int kept = 0;
    flow_begin(&flow, check, own, from);
    if (to_standstill(&flow, stop, period_us, &time_s, &distance_q40) == 0) {
        return 0;
    }
    if (remainder_keeps(check, &flow, distance_q40) != 0) {
        return 1;
    }
    if (flow.slow.m == 0) {
        return 0;
    }
    struct real step_s = real_div(time_s, real_make(STEPS, 0));
    const struct real even_s = step_s;
    const struct real least_s = real_scale(step_s, -MOST_HALVINGS);
    tried = flow.at.v.high;
    for (int i = 0; i < MOST_STEPS && kept == 0; i++) {
        struct states swept;
        const struct flow before = flow;
        flow_step(&flow, step_s, &swept);
        if (step_keeps(check, &flow, &swept, before.time_s) == 0) {
            if (real_less(least_s, step_s) == 0) {
                return 0;
            }
            flow = before;
            step_s = real_scale(step_s, -1);
            continue;
        }
        step_s = real_min(real_scale(step_s, 1), even_s);
        /* again when the speed is a quarter less */
        if (real_less(flow.at.v.high, real_mul(tried, real_make(3, -2))) != 0) {
            tried = flow.at.v.high;
            kept = to_standstill(&flow, stop, period_us, &time_s, &distance_q40) != 0 &&
                   remainder_keeps(check, &flow, distance_q40) != 0;
        }
    }
    return kept;
}

/* --- The parts of a piece --- */

/* Value between bounds on a part of the piece of a feed polynomial's derivative of that order. */
static struct span derivative(const struct feed_polynomial *poly, const struct span *u, int order)
{
    const struct real middle = mean(u->low, u->high);
    const struct real half = real_sub(u->high, middle);
    struct real c[FEED_DEGREE + 1];
    struct real aside = zero;
    struct real unit = real_make(1, 0);
    for (int k = 0; k <= FEED_DEGREE; k++) {
        c[k] = poly->c[k];
    }
    for (int n = 1; n <= order; n++) {
        for (int k = 0; k <= FEED_DEGREE - n; k++) {
            c[k] = real_times(c[k + 1], k + 1);
        }
        unit = real_mul(unit, poly->per_s);
    }
    path_motion_shift(c, FEED_DEGREE - order, middle);
    path_motion_stretch(c, FEED_DEGREE - order, half);
    for (int k = 1; k <= FEED_DEGREE - order; k++) {
        aside = real_add(aside, real_abs(c[k]));
    }
    const struct span out = {real_mul(real_sub(c[0], aside), unit),
                             real_mul(real_add(c[0], aside), unit)};
    return out;
}

/* Speed lambda F', acceleration lambda^2 F'' + lambda' F'; of a hold lambda' F' is at most a quarter of the
 * deceleration. */
static void states_of(const struct feed_polynomial *poly, const struct part *part,
                      struct real most_turned, struct states *out)
{
    struct span feed = derivative(poly, &part->u, 1);
    const struct span bend = derivative(poly, &part->u, 2);
    const struct span rate2 = {square(part->rate.low), square(part->rate.high)};
    feed.low = real_max(feed.low, zero);
    feed.high = real_max(feed.high, zero);
    struct span turned = product(&feed, &part->slope);
    turned.high = real_min(turned.high, most_turned);
    turned.low = real_min(turned.low, turned.high);
    out->low_q40_mm = poly->start_q40_mm - PIECE_SLACK_Q40 +
                      q40_of(path_motion_horner(poly->c, FEED_DEGREE, part->u.low));
    out->high_q40_mm = poly->start_q40_mm + PIECE_SLACK_Q40 +
                       q40_of(path_motion_horner(poly->c, FEED_DEGREE, part->u.high));
    out->v.low = real_mul(feed.low, part->rate.low);
    out->v.high = real_mul(feed.high, part->rate.high);
    out->a = sum(product(&bend, &rate2), turned);
}

static void halve(struct span *low, struct span *high)
{
    const struct real middle = mean(low->low, low->high);
    low->high = middle;
    high->low = middle;
}

static struct real width(const struct span *a)
{
    return real_sub(a->high, a->low);
}

/* Halves a part in the direction in which its states differ most in speed. */
static void split(const struct feed_polynomial *poly, const struct states *at,
                  const struct numbers *own, struct part *low, struct part *high)
{
    const struct real time_s =
        real_add(real_div(at->v.high, own->deep), real_div(own->deep, own->down));
    const struct span feed = derivative(poly, &low->u, 1);
    const struct span bend = derivative(poly, &low->u, 2);
    const struct real instants = real_div(width(&low->u), poly->per_s);
    const struct real by_time =
        real_add(real_mul(instants, real_max(real_abs(bend.low), real_abs(bend.high))),
                 real_div(real_mul(instants, at->v.high), time_s));
    const struct real by_rate = real_mul(width(&low->rate), feed.high);
    const struct real by_slope =
        real_scale(real_mul(real_mul(width(&low->slope), at->v.high), time_s), -1);
    *high = *low;
    if (real_less(by_time, by_rate) != 0 && real_less(by_rate, by_slope) == 0) {
        halve(&low->rate, &high->rate);
    } else if (real_less(by_time, by_slope) != 0) {
        halve(&low->slope, &high->slope);
    } else {
        halve(&low->u, &high->u);
    }
}

/* The stops of a piece that are to be proved. */
struct stops {
    const struct program_stop *own;
    struct numbers numbers;
    struct real most_turned;
    const struct feed_polynomial *poly;
};

/* All of a part, which is halved where necessary; depth first. */
static int parts_keep(struct brake_check *check, const struct stops *stops,
                      const struct part *whole)
{
    const struct feed_polynomial *poly = stops->poly;
    struct part parts[MOST_PARTS];
    uint32_t count = 1;
    parts[0] = *whole;
    while (count > 0u) {
        struct states from;
        struct part *last = &parts[count - 1u];
        states_of(poly, last, stops->most_turned, &from);
        program_limits_attend(check->limits);
        if (brakes_keep(check, stops->own, &stops->numbers, &from) != 0) {
            count--;
        } else if (count == MOST_PARTS || check->evaluations > check->most_evaluations) {
            return 0;
        } else {
            split(poly, &from, &stops->numbers, last, last + 1);
            count++;
        }
    }
    return 1;
}

static struct real level_rate(const struct program_override *bounds, uint32_t level)
{
    return level == PROGRAM_LEVEL_FULL ? real_make(bounds->factor_q14, -14)
                                       : real_make((int64_t)program_level_q9(level), -9);
}

/* The greatest override rate up to an override: the lower one of the level's, and sqrt(2 q override), which the
 * override acceleration q can reach from a constant override of 0. */
static struct real greatest_slope(const struct program_override *bounds, uint32_t level,
                                  struct real rate)
{
    const struct real second = real_make((int64_t)program_number(bounds->second[level]), -24);
    const struct real level_slope = real_make((int64_t)stop_level_slope_q16(bounds, level), -16);
    return real_min(level_slope, real_root(real_scale(real_mul(second, rate), 1)));
}

static int levels_keep(struct brake_check *check, const struct stops *stops)
{
    const struct feed_polynomial *poly = stops->poly;
    struct part part = {{zero, real_make(1, 0)}, {zero, zero}, {zero, zero}};
    int kept = 1;
    for (uint32_t level = 0; level < PROGRAM_LEVELS && kept != 0; level++) {
        for (int i = level == 0u ? LOW_RATES : 0; i >= 0 && kept != 0; i--) {
            part.rate.high = real_scale(level_rate(&poly->override, level), -i);
            part.slope.high = greatest_slope(&poly->override, level, part.rate.high);
            part.slope.low = real_negative(part.slope.high);
            kept = parts_keep(check, stops, &part);
            part.rate.low = part.rate.high;
        }
    }
    return kept;
}

/* --- Pieces --- */

/* Duration of a piece in ms, held at 10^4. */
static uint32_t piece_ms(const struct program *p, uint32_t piece)
{
    const uint64_t duration_q32 = program_piece_duration(p, piece);
    const uint64_t most_q32 = (uint64_t)10 << 32;
    return (uint32_t)((duration_q32 < most_q32 ? duration_q32 : most_q32) * 1000u >> 32);
}

void brake_check_begin(struct brake_check *check, const struct program *p,
                       const struct program_limits *limits)
{
    path_bounds_begin(&check->bounds, p);
    check->limits = limits;
    check->any = path_motion_limits(&check->limit, limits, p->header.axis_count);
    check->period_s = real_div(real_make((int64_t)p->header.period_us, 0), real_make(1000000, 0));
    check->hint = 0;
    check->evaluations = 0;
}

int brake_check_piece(struct brake_check *check, uint32_t piece, enum program_stop_kind kind,
                      const struct program_stop *stop)
{
    const struct program *p = check->bounds.program;
    const int fault = kind == PROGRAM_STOP_FAULT;
    struct feed_polynomial poly;
    struct stops stops = {.own = stop, .poly = &poly};
    check->evaluations = 0;
    if (check->any == 0 || stop->deceleration == 0u) {
        return 1;
    }
    path_motion_read_piece(&poly, p, piece);
    check->most_evaluations =
        MOST_EVALUATIONS + (uint32_t)(piece_ms(p, piece) * EVALUATIONS_PER_S / 1000u);
    while (check->hint > 0u && program_segment_start(p, check->hint) > poly.start_q40_mm) {
        check->hint--;
    }
    while (check->hint + 1u < p->header.segment_count &&
           program_segment_start(p, check->hint + 1u) <= poly.start_q40_mm) {
        check->hint++;
    }
    read_numbers(&stops.numbers, stop);
    stops.most_turned = fault ? real_make(1, 30) : real_scale(stops.numbers.deep, -2);
    return levels_keep(check, &stops);
}
