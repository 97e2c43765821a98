/* SPDX-License-Identifier: MIT */
/* Implements core/stop_check.h (see there): how long a stop can take, and whether the stop table covers it. A part of
 * program_check; core/brake_check uses it too, and the host tools compute the table with it. Main loop. Changes only its arguments; no I/O. */
#include "core/stop_check.h"

#include "core/feed_bounds.h"
#include "core/qmath.h"

#define NO_BOUND  UINT32_MAX /* no bound of time or distance */
#define END_TICKS 2u /* until a command counts, and until the end of the program is a setpoint */

/* Larger values count as no bound: 2^14 mm/s, 2^24 mm/s^2. So no product below exceeds 2^63. */
#define MOST_SPEED_UM  ((uint64_t)1 << 24)
#define MOST_CHANGE_UM ((uint64_t)1 << 34)
#define MOST_TIME_US   ((uint64_t)1 << 32)

/* --- Numbers of the table, as floor of their exact values --- */

static const uint32_t eighth_q16[8] = {65536u, 71468u,  77935u,  84990u,
                                       92681u, 101070u, 110217u, 120193u};

/* Decelerations in 2^-24 mm/s^2, jerks in 2^-18 mm/s^3; below 2^48. */
static uint64_t number(uint32_t code)
{
    return (uint64_t)eighth_q16[code & 7u] << (code >> 3);
}

static uint64_t lesser(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t greater(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* Time in us in which a jerk (2^-18 mm/s^3) makes an acceleration (um/s^2, up to 2^34): a 2^18 1000 / j. */
static uint64_t jerk_time_us(uint64_t change_um, uint64_t jerk_q18)
{
    return qmath_div_up_u64(change_um * 1000u, greater(jerk_q18 >> 18, 1u));
}

/* --- Motion of a piece in which a path stop begins --- */

/* a 1000 / 2^bits, up; a < 2^52 */
static uint64_t thousands(int64_t a, int bits)
{
    return a <= 0 ? 0u : (((uint64_t)a * 1000u) >> bits) + 1u;
}

/* value (um, up to 2^34) times the factor of the override, up. */
static uint64_t scaled(uint64_t value, uint32_t factor_q24)
{
    return ((value * (factor_q24 >> 8)) >> 16) + (value >> 16) + 1u;
}

/* v >= f^3 a^2 / (2 j) and the change in three ticks, all at the lowest speed and the strongest deceleration. */
static int settled(const struct program *p, uint64_t speed_um, uint64_t falling_um,
                   uint32_t factor_q24, uint64_t jerk_q18)
{
    uint64_t fall = scaled(scaled(falling_um, factor_q24), factor_q24);
    uint64_t time_us = jerk_time_us(fall, jerk_q18);
    if (falling_um == 0u) {
        return 1;
    }
    if (time_us >= (uint64_t)1 << 28 || fall > MOST_CHANGE_UM) {
        return 0;
    }
    time_us = time_us / 2u + 3u * p->header.period_us;
    return speed_um > qmath_div_up_u64(fall * time_us, 1000000u);
}

static uint64_t held(int64_t value, int bits, uint64_t most)
{
    return value >= (int64_t)1 << 52 ? most + 1u : lesser(thousands(value, bits), most + 1u);
}

static void extent_waits(struct stop_extent *out, const struct program *p,
                         const struct program_piece *c, const int64_t low[2][FEED_PARTS],
                         uint64_t jerk_up_q18)
{
    uint32_t run = 0;
    out->waits = 0;
    for (int i = 0; i < FEED_PARTS; i++) {
        uint64_t least =
            low[0][i] <= 0 ? 0u : lesser((uint64_t)low[0][i], MOST_SPEED_UM << 14) * 1000u >> 24;
        uint64_t falling = held(-low[1][i], 24, MOST_CHANGE_UM);
        run = settled(p, least, falling, c->override_factor_q24, jerk_up_q18) ? 0u : run + 1u;
        out->waits = run > out->waits ? run : out->waits;
    }
    out->last = run;
}

/* Greatest override in a level. */
static uint32_t level_rate_q24(const struct program_override *bounds, uint32_t level)
{
    return level == PROGRAM_LEVEL_FULL ? (uint32_t)bounds->factor_q14 << 10
                                       : program_level_q9(level) << 15;
}

/* Greatest override rate, 2^-16 /s: it rises from 0 and falls to 0 again, with at most the override acceleration, while
 * the override changes by at most its greatest value. */
static uint64_t greatest_slope_q16(const struct program_override *bounds, uint32_t level)
{
    const uint64_t second_q8 =
        lesser((program_number(bounds->second[level]) >> 16) + 1u, (uint64_t)1 << 32);
    const uint64_t square_q32 = level_rate_q24(bounds, level) * second_q8;
    const uint64_t rate_q16 = (program_number(bounds->rate[level]) >> 16) + 1u;
    return lesser(rate_q16, qmath_root(square_q32) + 1u);
}

uint64_t stop_level_slope_q16(const struct program_override *bounds, uint32_t level)
{
    return greatest_slope_q16(bounds, level);
}

void stop_level_start(const struct stop_extent *extent, const struct program_override *bounds,
                      uint32_t level, struct stop_start *out)
{
    const uint32_t rate_q24 = level_rate_q24(bounds, level);
    const uint64_t slope_q16 = greatest_slope_q16(bounds, level);
    out->speed_um = scaled(extent->speed_um, rate_q24);
    out->rising_um = scaled(scaled(extent->rising_um, rate_q24), rate_q24);
    out->slope_um = (slope_q16 * lesser(extent->speed_um, MOST_SPEED_UM) >> 16) + 1u;
    /* slope 2^-16 over second 2^-24: 10^6 2^8 */
    out->cut_us = qmath_div_up_u64(slope_q16 * 256000000u, program_number(bounds->second[level]));
}

/* Lower bounds of the eighths; gives the upper one of all. */
static int64_t parts_below(const struct program_piece *c, enum feed_derivative what,
                           int64_t low[FEED_PARTS])
{
    int64_t high[FEED_PARTS];
    feed_bounds_parts(c, what, low, high);
    for (int i = 1; i < FEED_PARTS; i++) {
        high[0] = qmath_greater(high[0], high[i]);
    }
    return high[0];
}

void stop_piece_extent(const struct program *p, uint32_t piece, uint64_t jerk_up_q18,
                       struct stop_extent *out)
{
    struct program_piece c;
    int64_t low[2][FEED_PARTS];
    program_piece_get(p, piece, &c);
    uint64_t speed = held(parts_below(&c, FEED_VELOCITY, low[0]), 24, MOST_SPEED_UM);
    out->speed_um = speed;
    out->rising_um = held(parts_below(&c, FEED_ACCELERATION, low[1]), 24, MOST_CHANGE_UM);
    extent_waits(out, p, &c, (const int64_t (*)[FEED_PARTS])low, jerk_up_q18);
}

/* --- The path stop --- */

/* The S-curve to standstill in continuous time. Any deceleration up to the number gives a bound; that of the root is
 * near the least bound. */
struct stop_bound stop_curve(const struct stop_start *from, const struct program_stop *stop)
{
    const struct stop_bound none = {NO_BOUND, NO_BOUND};
    uint64_t down = lesser(number(stop->jerk_down) >> 18, (uint64_t)1 << 29);
    uint64_t up = lesser(number(stop->jerk_up) >> 18, (uint64_t)1 << 29);
    down = greater(down, 1u);
    up = greater(up, 1u);
    if (from->speed_um > MOST_SPEED_UM || from->rising_um + from->slope_um > MOST_CHANGE_UM) {
        return none;
    }
    uint64_t even_lead_us = qmath_div_up_u64(from->rising_um * 1000u, down);
    uint64_t slope_lead_us = qmath_div_up_u64(from->slope_um * 1000u, down);
    uint64_t lead_us = even_lead_us + slope_lead_us;
    if (lead_us >= (uint64_t)1 << 28) {
        return none;
    }
    uint64_t peak_um =
        from->speed_um +
        qmath_div_up_u64(from->rising_um * (even_lead_us + 2u * slope_lead_us), 2000000u);
    if (slope_lead_us > from->cut_us) {
        peak_um += qmath_div_up_u64(from->slope_um * (slope_lead_us - from->cut_us), 2000000u);
    }
    if (peak_um > 2u * MOST_SPEED_UM) {
        return none;
    }
    uint64_t mean = greater(qmath_div_u64(2u * down * up, down + up), 1u); /* mm/s^3 */
    uint64_t most = number(stop->deceleration) * 125u >> 21;               /* um/s^2 */
    uint64_t depth = greater(lesser(qmath_root(peak_um * mean * 1000u), most), 1u);
    uint64_t first_us = qmath_div_up_u64(depth * 1000u, down);
    uint64_t last_us = qmath_div_up_u64(depth * 1000u, up);
    uint64_t even_us = qmath_div_up_u64(peak_um * 1000000u, depth);
    uint64_t time_us = lead_us + even_us + (first_us + last_us) / 2u + 1u;
    if (time_us >= MOST_TIME_US) {
        return none;
    }
    /* the distance is the speed times the centre of the deceleration in time */
    uint64_t centre_us = lead_us + (time_us - lead_us) / 2u + 1u;
    centre_us += first_us > last_us ? qmath_div_u64(first_us - last_us, 6u) + 1u : 0u;
    uint64_t distance_um = qmath_div_up_u64(peak_um * centre_us, 1000000u);
    struct stop_bound out = {(uint32_t)time_us, (uint32_t)lesser(distance_um, NO_BOUND)};
    return out;
}

static struct stop_bound sum(struct stop_bound a, uint64_t time_us, uint64_t distance_um)
{
    struct stop_bound out = {
        (uint32_t)lesser(a.time_us + time_us, NO_BOUND),
        (uint32_t)lesser(a.distance_um + distance_um, NO_BOUND),
    };
    return out;
}

static struct stop_bound most_of(struct stop_bound a, struct stop_bound b)
{
    struct stop_bound out = {a.time_us > b.time_us ? a.time_us : b.time_us,
                             a.distance_um > b.distance_um ? a.distance_um : b.distance_um};
    return out;
}

/* q / 2^bits in millionths, up, where that is below 2^32; else `most`. */
static uint64_t micro(uint64_t q, int bits, uint64_t most)
{
    return q >= (uint64_t)1 << 43 ? most : qmath_div_up_u64(q * 1000000u, (uint64_t)1 << bits);
}

/* Time of so many eighths of a piece. */
static uint64_t eighths_us(const struct program *p, uint32_t piece, uint32_t count)
{
    return micro(program_piece_duration(p, piece) * count, 35, NO_BOUND);
}

/* For a path stop that begins at an override of one level. */
static struct stop_bound level_bound(const struct program *p, const struct stop_start *start,
                                     const struct program_stop *stop, enum program_stop_kind kind)
{
    struct stop_start from = *start;
    uint64_t more_us = STOP_TICKS * (uint64_t)p->header.period_us;
    uint64_t little = number(stop->deceleration) * 125u >> 23;
    if (kind == PROGRAM_STOP_HOLD &&
        from.slope_um > little) { /* a rising ramp ends early first, until it adds little */
        more_us += from.cut_us;
        from.cut_us = from.slope_um > MOST_CHANGE_UM || from.cut_us >= (uint64_t)1 << 28
                          ? 0u
                          : qmath_div_u64(from.cut_us * little, from.slope_um);
        from.slope_um = little;
    }
    /* half a tick more of the first part */
    uint64_t half_um = qmath_div_up_u64(
        lesser(from.rising_um + from.slope_um, MOST_CHANGE_UM) * p->header.period_us, 2000000u);
    from.speed_um = lesser(from.speed_um + half_um, MOST_SPEED_UM + 1u);
    struct stop_bound out = stop_curve(&from, stop);
    return sum(out, more_us,
               qmath_div_up_u64(from.speed_um * lesser(more_us, MOST_TIME_US), 1000000u));
}

/* The bound with the stop parameters of a piece, for a path stop that begins in it. */
static struct stop_bound brake_bound(const struct program *p, uint32_t piece,
                                     const struct stop_extent *extent,
                                     const struct program_stop *stop, enum program_stop_kind kind)
{
    const uint64_t wait_us = eighths_us(p, piece, extent->waits);
    struct program_override bounds;
    struct stop_bound out = {0, 0};
    uint64_t speed_um = 0;
    program_piece_override(p, piece, &bounds);
    for (uint32_t level = 0; level < PROGRAM_LEVELS; level++) {
        struct stop_start start;
        stop_level_start(extent, &bounds, level, &start);
        out = most_of(out, level_bound(p, &start, stop, kind));
        speed_um = greater(speed_um, start.speed_um);
    }
    return sum(out, wait_us,
               qmath_div_up_u64(
                   lesser(speed_um, MOST_SPEED_UM + 1u) * lesser(wait_us, MOST_TIME_US), 1000000u));
}

/* The nominal motion continues through the last eighths of the piece into the next piece. */
static struct stop_bound waited(const struct program *p, uint32_t piece, uint32_t eighths,
                                struct stop_bound next)
{
    int64_t from = program_piece_start(p, piece);
    int64_t to = piece + 1u < p->header.piece_count ? program_piece_start(p, piece + 1u)
                                                    : p->header.length_q40_mm;
    uint64_t distance_um =
        to <= from ? 0u : ((uint64_t)(to - from) >> 30) + 1u; /* below 2^-30 mm < um */
    return sum(next, eighths_us(p, piece, eighths), distance_um);
}

/* --- The walk --- */

void stop_walk_begin(struct stop_walk *walk, const struct program *p, enum program_stop_kind kind)
{
    const struct stop_bound rest = {0, 0};
    const struct stop_bound end = {END_TICKS * p->header.period_us, 0};
    walk->program = p;
    walk->kind = kind;
    /* periods in 2^-32 s, up: 2^32 / 10^6 < 4295 */
    walk->window_q32_s = (uint64_t)STOP_WINDOW_TICKS * p->header.period_us * 4295u;
    walk->next = end;
    walk->count = 0;
    for (int k = 0; k < STOP_WINDOW; k++) {
        walk->own[k] = rest;
        walk->duration_q32_s[k] = 0;
    }
}

static void remember(struct stop_walk *walk, struct stop_bound own, uint64_t duration_q32_s)
{
    for (int k = STOP_WINDOW - 1; k > 0; k--) {
        walk->own[k] = walk->own[k - 1];
        walk->duration_q32_s[k] = walk->duration_q32_s[k - 1];
    }
    walk->own[0] = own;
    walk->duration_q32_s[0] = duration_q32_s;
    walk->count += walk->count < STOP_WINDOW ? 1u : 0u;
}

struct stop_bound stop_walk_back(struct stop_walk *walk, uint32_t piece)
{
    const struct program *p = walk->program;
    struct program_stop stop;
    struct stop_extent extent = {.last = FEED_PARTS};
    struct stop_bound own = {0, 0};
    program_stop_get(p, piece, walk->kind, &stop);
    if (stop.deceleration != 0u) {
        stop_piece_extent(p, piece, number(stop.jerk_up), &extent);
        own = brake_bound(p, piece, &extent, &stop, walk->kind);
    }
    if (extent.last != 0u) {
        own = most_of(own, waited(p, piece, extent.last, walk->next));
    }
    struct stop_bound out = own;
    uint64_t ahead = 0;
    for (uint32_t k = 0; k < walk->count && ahead < walk->window_q32_s; k++) {
        out = most_of(out, walk->own[k]);
        ahead += walk->duration_q32_s[k];
    }
    remember(walk, own, program_piece_duration(p, piece));
    walk->next = out;
    return out;
}

/* --- The check --- */

/* No number above the limits; a limit of 0 is none. */
static int within_limits(const struct program_stop *stop, const struct program_limits *limits)
{
    uint64_t jerk = (uint64_t)limits->jerk_mm_s3 << 18;
    /* 2^-24 mm/s^2 against um/s^2 = 10^-3 mm/s^2 */
    int fits = limits->acceleration_um_s2 == 0u ||
               number(stop->deceleration) * 125u >> 21 <= limits->acceleration_um_s2;
    return fits &&
           (jerk == 0u || (number(stop->jerk_down) <= jerk && number(stop->jerk_up) <= jerk));
}

static int check_entry(const struct program_stop *stop, const struct program_limits *limits)
{
    int some = stop->jerk_down != 0u || stop->deceleration != 0u || stop->jerk_up != 0u;
    int all = stop->jerk_down != 0u && stop->deceleration != 0u && stop->jerk_up != 0u;
    if (stop->reserved != 0u || some != all) {
        return PROGRAM_ERR_STOP_ENTRY;
    }
    return !all || within_limits(stop, limits) ? 0 : PROGRAM_ERR_STOP_NUMBERS;
}

static int check_entries(const struct program *p, const struct program_limits *limits,
                         uint32_t *index)
{
    for (*index = 0; *index < p->header.piece_count; (*index)++) {
        for (int kind = PROGRAM_STOP_HOLD; kind <= PROGRAM_STOP_FAULT; kind++) {
            struct program_stop stop;
            program_stop_get(p, *index, (enum program_stop_kind)kind, &stop);
            int code = check_entry(&stop, limits);
            if (code != 0) {
                return code;
            }
        }
    }
    return 0;
}

/* The bounds of a kind, and the header's worst. */
static int check_kind(const struct program *p, enum program_stop_kind kind,
                      const struct program_limits *limits, const struct stop_bound *said,
                      uint32_t *index)
{
    const uint32_t most_ms = kind == PROGRAM_STOP_FAULT ? limits->stop_time_ms : 0u;
    struct stop_walk walk;
    uint32_t longest_us = 0;
    uint32_t longest_um = 0;
    stop_walk_begin(&walk, p, kind);
    for (uint32_t i = p->header.piece_count; i > 0u; i--) {
        struct program_stop stop;
        struct stop_bound bound = stop_walk_back(&walk, i - 1u);
        program_stop_get(p, i - 1u, kind, &stop);
        *index = i - 1u;
        if (stop.bound_us < bound.time_us) {
            return PROGRAM_ERR_STOP_BOUND;
        }
        if (most_ms != 0u && stop.bound_us > (uint64_t)most_ms * 1000u) {
            return PROGRAM_ERR_STOP_LONG;
        }
        longest_us = stop.bound_us > longest_us ? stop.bound_us : longest_us;
        longest_um = bound.distance_um > longest_um ? bound.distance_um : longest_um;
        program_limits_attend(limits);
    }
    *index = 0;
    return said->time_us == longest_us && said->distance_um >= longest_um ? 0
                                                                          : PROGRAM_ERR_STOP_WORST;
}

int stop_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index)
{
    const struct program_header *h = &p->header;
    const struct stop_bound hold = {h->hold_worst_us, h->hold_worst_um};
    const struct stop_bound fault = {h->fault_worst_us, h->fault_worst_um};
    int code = check_entries(p, limits, index);
    if (code == 0) {
        code = check_kind(p, PROGRAM_STOP_HOLD, limits, &hold, index);
    }
    if (code == 0) {
        code = check_kind(p, PROGRAM_STOP_FAULT, limits, &fault, index);
    }
    return code;
}
