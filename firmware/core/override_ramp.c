/* SPDX-License-Identifier: MIT */
/* Implements core/override_ramp.h (see there): ramps of the feed override from one constant value to another. Used by
 * core/chunk, core/coefficients, core/override_plan and core/program_clock. Pure, any context. */
#include "core/override_ramp.h"

#include "core/qmath.h"

#define MOST_RATE_CODE   207u /* at 1 ms R is below 2^56 up to this code, */
#define MOST_SECOND_CODE 223u /* and S up to this one */
#define ALIKE            4u   /* a factor of 1.4 */
#define SHORT_TICKS      40u

/* --- What the program allows --- */

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

void override_bounds_of(struct program_override *out, const struct program *p, uint32_t first,
                        uint32_t count)
{
    const uint32_t left = p->header.piece_count - first;
    const uint32_t after = first + least(count, left);
    struct program_override own;
    program_piece_override(p, first, out);
    for (uint32_t i = first + 1u; i < after; i++) {
        program_piece_override(p, i, &own);
        out->factor_q14 = (uint16_t)least(out->factor_q14, own.factor_q14);
        for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
            out->rate[k] = (uint8_t)least(out->rate[k], own.rate[k]);
            out->second[k] = (uint8_t)least(out->second[k], own.second[k]);
        }
    }
}

/* --- Stages --- */

static int64_t override_of(uint32_t level)
{
    return (int64_t)program_level_q9(level) << 48;
}

/* The first level with this override in it. */
static uint32_t level_of(int64_t override_q57)
{
    const uint32_t above_q9 = (uint32_t)((override_q57 + ((int64_t)1 << 48) - 1) >> 48);
    uint32_t level = 0;
    for (uint32_t k = 0; k < PROGRAM_LEVEL_FULL; k++) {
        level += program_level_q9(k) < above_q9 ? 1u : 0u;
    }
    return level;
}

/* The bounds of the higher level are not much below those of the lower one: two ramps would not be faster than one. */
static int alike(const struct program_override *bounds, uint32_t high, uint32_t low)
{
    return bounds->rate[high] + ALIKE >= bounds->rate[low] &&
           bounds->second[high] + ALIKE >= bounds->second[low];
}

/* A ramp up begins in the level just above its start. */
void override_change_of(struct ramp_change *out, int64_t from_q57, int64_t to_q57)
{
    const int up = from_q57 < to_q57;
    const uint32_t first = level_of(up ? from_q57 + 2 * OVERRIDE_SPARE : from_q57);
    const uint32_t last = level_of(to_q57);
    out->from_q57 = from_q57;
    out->to_q57 = to_q57;
    out->first = up ? least(first, last) : first;
    out->last = last;
}

static void stage_up(struct ramp_stage *out, const struct program_override *bounds,
                     const struct ramp_change *change)
{
    uint32_t level = change->first;
    while (level < change->last && alike(bounds, level + 1u, change->first)) {
        level++;
    }
    out->level = level;
    out->end_q57 = level < change->last ? override_of(level) : change->to_q57;
}

/* The stage ends just inside the first lower level with different bounds. */
static void stage_down(struct ramp_stage *out, const struct program_override *bounds,
                       const struct ramp_change *change)
{
    uint32_t low = change->first;
    while (low > change->last && alike(bounds, change->first, low - 1u)) {
        low--;
    }
    out->level = change->first;
    out->end_q57 = change->to_q57;
    if (low > change->last && override_of(low - 1u) - OVERRIDE_SPARE > change->to_q57) {
        out->end_q57 = override_of(low - 1u) - OVERRIDE_SPARE;
    }
}

void override_stage_of(struct ramp_stage *out, const struct program_override *bounds,
                       const struct ramp_change *change)
{
    if (change->from_q57 < change->to_q57) {
        stage_up(out, bounds, change);
    } else {
        stage_down(out, bounds, change);
    }
}

/* --- Bounds of a level --- */

/* A code above 0 is T 2^s / 2^16 octaves, T from 2^16 (program_number). With h the period in ms: R = number 2^21 h /
 * 125, so 2^61 / R = (125 2^40 / T) 2^-s / h; S = number 2^26 h^2 / 15625. */
void override_limits_of(struct ramp_limits *out, const struct program_override *bounds,
                        uint32_t level, uint32_t period_log2)
{
    /* ceil(125 2^40 / T) */
    static const uint32_t slopes[8] = {2097152000u, 1923083807u, 1763507455u, 1617119114u,
                                       1482924801u, 1359839255u, 1246985071u, 1143485507u};
    /* ceil(125 2^32 / sqrt(T)), and of 2 T */
    static const uint32_t roots[16] = {2097152000u, 2008232818u, 1923107690u, 1841560367u,
                                       1763496162u, 1688724256u, 1617132411u, 1548568022u,
                                       1482910401u, 1420035044u, 1359842489u, 1302179824u,
                                       1246980095u, 1194108373u, 1143485294u, 1095002950u};
    /* 125 2^20 2^(i/8), and 2^-15 of it for the rounding of T */
    static const uint32_t ratios[8] = {131076000u, 142939392u, 155876512u, 169984542u,
                                       185369457u, 202146827u, 220442678u, 240394444u};
    const uint32_t rate = least(bounds->rate[level], MOST_RATE_CODE - 8u * period_log2);
    const uint32_t second = least(bounds->second[level], MOST_SECOND_CODE - 16u * period_log2);
    const uint32_t apart = rate + 256u - second; /* R / S = number / number 125 / (2^5 h) */
    const uint32_t down = 25u + 32u + period_log2 - (apart >> 3);
    out->inverse_slope = (slopes[rate & 7u] >> ((rate >> 3) + period_log2)) + 1u;
    out->inverse_root = (roots[second & 15u] >> ((second >> 4) + period_log2)) + 1u;
    out->rate_ticks = (down < 32u ? ratios[apart & 7u] >> down : 0u) + 1u;
}

/* --- Duration --- */

void override_ticks_of(struct ramp_ticks *ticks, const struct ramp_limits *limits,
                       int64_t change_q57)
{
    const uint32_t change_q30 = (uint32_t)(change_q57 >> 27) + 1u;
    const int shift = qmath_clz32(change_q30) & ~1;
    const uint32_t root = qmath_root_above(change_q30 << shift);
    const uint32_t rate_ticks =
        ((uint32_t)(qmath_product_unsigned(root, limits->inverse_root) >> 32) >> (shift / 2)) + 1u;
    const uint32_t half =
        ((uint32_t)(qmath_product_unsigned(change_q30, limits->inverse_slope) >> 32) >> 3) + 1u;
    ticks->rise = rate_ticks < limits->rate_ticks ? rate_ticks : limits->rate_ticks;
    ticks->half = half > ticks->rise ? half : ticks->rise;
}

int64_t override_step_of(const struct ramp_ticks *ticks, int64_t change_q57)
{
    const uint64_t parts = qmath_product_unsigned(ticks->rise, ticks->half) << 1;
    return (int64_t)qmath_div_u64((uint64_t)change_q57, parts);
}

uint64_t override_span_q32(const struct ramp_ticks *ticks, int64_t mean_q57, uint32_t period_q32_s)
{
    const uint32_t mean_q16 = (uint32_t)(mean_q57 >> 41) + 1u;
    const uint32_t tick_q32_s =
        (uint32_t)(qmath_product_unsigned(period_q32_s, mean_q16) >> 16) + 1u;
    return qmath_product_unsigned(ticks->rise + ticks->half, tick_q32_s);
}

/* --- A ramp under way --- */

void override_ramp_begin(struct override_ramp *ramp, int64_t from_q57,
                         const struct ramp_ticks *ticks, int64_t step_q56)
{
    ramp->step_q56 = step_q56;
    ramp->end_q57 = from_q57;
    ramp->rise = ticks->rise;
    ramp->even = ticks->half - ticks->rise;
    ramp->fall = 0;
}

void override_ramp_shorten(struct override_ramp *ramp)
{
    const uint32_t most = 2u * ramp->rise + SHORT_TICKS;
    ramp->even = ramp->even < most ? ramp->even : most;
}

void override_ramp_cut(struct override_ramp *ramp)
{
    ramp->rise = 0;
    ramp->even = 0;
}

/* A tick more of rise is one more of fall: twice what it raises the override by. */
int64_t override_ramp_slope(struct override_ramp *ramp, int64_t slope_q56)
{
    int64_t next = slope_q56;
    if (ramp->rise > 0) {
        ramp->rise--;
        ramp->fall++;
        next += ramp->step_q56;
        ramp->end_q57 += 2 * (slope_q56 + next);
    } else if (ramp->even > 0) {
        ramp->even--;
        ramp->end_q57 += 2 * slope_q56;
    } else if (ramp->fall > 0) {
        ramp->fall--;
        next -= ramp->step_q56;
    }
    return next;
}
