/* SPDX-License-Identifier: MIT */
#include "core/path_brake.h"

#include "core/qmath.h"

#define FINE_BITS 16 /* from q40 to q56 */
#define MOST_Q56  ((int64_t)1 << 60)
#define ATTEMPTS  8
#define SIX       6
#define MOST_Q16  ((uint64_t)PATH_BRAKE_MOST_TICKS << 16)

/* --- Numbers of the stop table (docs/protocol.md 1.4) --- */

/* About 2^16 2^(i/8): what the codes are defined by. */
static const uint32_t mantissa[8] = {65536u, 71468u,  77935u,  84990u,
                                     92681u, 101070u, 110217u, 120193u};

/* 2^51 / 10^6 and 2^61 / 10^9, rounded down: squared and cubed ms in s. */
#define SQUARED_MS_Q51 2251799813u
#define CUBED_MS_Q61   2305843009u

/* period_us = 1000 2^this */
static int period_exponent(uint32_t period_us)
{
    return 31 - qmath_clz32(period_us / 1000u);
}

static int64_t decoded(uint32_t code, uint32_t unit, int shift)
{
    const uint64_t product = qmath_product_unsigned(mantissa[code & 7u], unit);
    const int up = shift + (int)(code >> 3); /* of less than 2^48 */
    return up > 12 ? MOST_Q56 : qmath_shift((int64_t)product, up);
}

int path_brake_numbers_of(struct path_brake_numbers *out, const struct program_stop *stop,
                          uint32_t period_us)
{
    const int p = period_exponent(period_us);
    if (stop->jerk_down == 0 || stop->deceleration == 0 || stop->jerk_up == 0) {
        return 0;
    }
    /* m 2^-24 mm/s^2 in 2^-56 mm a tick squared; m 2^-18 mm/s^3 in 2^-56 mm a tick cubed */
    out->jerk_down_q56 = decoded(stop->jerk_down, CUBED_MS_Q61, 3 * p - 23);
    out->deceleration_q56 = decoded(stop->deceleration, SQUARED_MS_Q51, 2 * p - 19);
    out->jerk_up_q56 = decoded(stop->jerk_up, CUBED_MS_Q61, 3 * p - 23);
    return 1;
}

/* --- Plan --- */

struct ticks {
    uint32_t first;
    uint32_t second;
    uint32_t last;
};

static uint32_t whole_ticks(uint64_t ticks_q16)
{
    const uint32_t whole = (uint32_t)((ticks_q16 + 0xFFFFu) >> 16);
    return whole > 0u ? whole : 1u;
}

/* Time in which the acceleration falls from 0 to the peak of a brake without an even part: m ticks with
 * m^2 (1 + down/up) = 2 speed/down + (acceleration/down)^2. 0: more ticks than a brake may have. */
static uint64_t peak_time_q16(const struct path_state *from, const struct path_brake_numbers *n,
                              uint32_t lead_q16, uint64_t ratio_q16)
{
    const uint64_t sum_q32 = qmath_ratio(2 * from->speed_q56, n->jerk_down_q56, 32) +
                             qmath_product_unsigned(lead_q16, lead_q16);
    const int up = qmath_clz64(sum_q32 | 1u);
    const uint64_t square = qmath_div_u64(sum_q32 << up, ratio_q16 + 65536u);
    return up < 16 ? qmath_root(square << (16 - up)) : qmath_root(square >> (up - 16));
}

/* About as many ticks as the continuous brake takes; 0 where it takes too many, or would have to turn round. */
static int guess_ticks(struct ticks *ticks, const struct path_state *from,
                       const struct path_brake_numbers *n)
{
    const uint64_t lead_q16 =
        qmath_ratio(qmath_magnitude(from->acceleration_q56), n->jerk_down_q56, 16);
    const uint64_t ratio_q16 = qmath_ratio(n->jerk_down_q56, n->jerk_up_q56, 16);
    const uint64_t most_q16 = qmath_ratio(n->deceleration_q56, n->jerk_down_q56, 16);
    if (lead_q16 > MOST_Q16 || ratio_q16 >> 32 != 0) {
        return 0;
    }
    const uint64_t peak_q16 = peak_time_q16(from, n, (uint32_t)lead_q16, ratio_q16);
    const uint64_t used_q16 = peak_q16 < most_q16 ? peak_q16 : most_q16;
    if (used_q16 > MOST_Q16) {
        return 0;
    }
    const int64_t first_q16 = from->acceleration_q56 < 0 ? (int64_t)used_q16 - (int64_t)lead_q16
                                                         : (int64_t)used_q16 + (int64_t)lead_q16;
    const uint64_t last_q16 = qmath_product_unsigned((uint32_t)used_q16, (uint32_t)ratio_q16) >> 16;
    if (qmath_magnitude(first_q16) > (int64_t)MOST_Q16 || last_q16 > MOST_Q16 ||
        (first_q16 < 0 && peak_q16 < most_q16)) {
        return 0;
    }
    ticks->first = whole_ticks((uint64_t)qmath_magnitude(first_q16));
    ticks->second = 0;
    ticks->last = whole_ticks(last_q16);
    return 1;
}

/* Peak times (n1 + 2 n2 + n3) of a brake with so many ticks in its first part; below 2^63. 0: no speed is left for it. */
static int64_t twice_speed(const struct path_state *from, uint32_t first)
{
    const int64_t a = from->acceleration_q56;
    if ((qmath_magnitude(a) >> 20) * (int64_t)first >= (int64_t)1 << 41) {
        return 0;
    }
    return qmath_greater(2 * from->speed_q56 + a * (int64_t)first, 0);
}

/* As many even ticks as the deceleration needs that the jerks leave. */
static int add_even(struct ticks *ticks, const struct path_state *from,
                    const struct path_brake_numbers *n)
{
    const int64_t left = twice_speed(from, ticks->first);
    const uint64_t needed = qmath_ratio(left, n->deceleration_q56, 0); /* n1 + 2 n2 + n3 */
    const uint32_t jerks = ticks->first + ticks->last;
    if (needed > 2u * PATH_BRAKE_MOST_TICKS) {
        return 0;
    }
    ticks->second = needed > jerks ? ((uint32_t)needed - jerks) / 2u : 0u;
    return 1;
}

/* Jerks for these ticks, if they keep the numbers; else a tick more of what is too short. */
static int fit(struct path_brake *brake, struct ticks *ticks, const struct path_state *from,
               const struct path_brake_numbers *n)
{
    const uint32_t sum = ticks->first + 2u * ticks->second + ticks->last;
    const uint64_t parts = qmath_product_unsigned(SIX * sum, ticks->last);
    const int64_t up = (int64_t)qmath_div_u64((uint64_t)twice_speed(from, ticks->first), parts);
    const int64_t peak = SIX * up * (int64_t)ticks->last;
    if (SIX * up > n->jerk_up_q56) {
        ticks->last++;
        return 0;
    }
    if (peak > n->deceleration_q56) {
        ticks->second++;
        return 0;
    }
    const int64_t way = from->acceleration_q56 + peak;
    const int64_t size =
        (int64_t)qmath_div_u64((uint64_t)qmath_magnitude(way), SIX * (uint64_t)ticks->first);
    if (SIX * size > n->jerk_down_q56) {
        ticks->first++;
        return 0;
    }
    const int64_t down = way < 0 ? -size : size;
    brake->up_q56 = up;
    brake->down_q56 = down;
    brake->at.acceleration_q56 = SIX * down * (int64_t)ticks->first - peak;
    brake->at.speed_q56 =
        (peak * (int64_t)sum - brake->at.acceleration_q56 * (int64_t)ticks->first) / 2;
    return 1;
}

static int in_range(const struct path_state *from)
{
    return from->speed_q56 >= PATH_BRAKE_NO_SPEED && from->speed_q56 <= PATH_BRAKE_MOST_SPEED &&
           qmath_magnitude(from->acceleration_q56) <= MOST_Q56;
}

int path_brake_plan(struct path_brake *brake, const struct path_state *from,
                    const struct path_brake_numbers *numbers)
{
    struct path_brake found;
    struct ticks ticks;
    if (!in_range(from) || !guess_ticks(&ticks, from, numbers) ||
        !add_even(&ticks, from, numbers)) {
        return 0;
    }
    found.at = *from;
    for (int i = 0; i < ATTEMPTS; i++) {
        if (twice_speed(from, ticks.first) == 0) {
            return 0;
        }
        if (fit(&found, &ticks, from, numbers)) {
            found.first = ticks.first;
            found.second = ticks.second;
            found.last = ticks.last;
            *brake = found;
            return 1;
        }
    }
    return 0;
}

/* --- Tick --- */

/* A sixth of the jerk of the next tick. */
static int64_t jerk(const struct path_brake *brake)
{
    return brake->first != 0 ? -brake->down_q56 : brake->second != 0 ? 0 : brake->up_q56;
}

void path_brake_step(struct path_brake *brake)
{
    struct path_state *at = &brake->at;
    const int64_t j = jerk(brake);
    if (path_brake_ticks(brake) == 0) {
        return;
    }
    const int64_t way = at->speed_q56 + (at->acceleration_q56 >> 1) + j + (int64_t)at->fine_q56_mm;
    at->arc_length_q40_mm += way >> FINE_BITS;
    at->fine_q56_mm = (uint32_t)way & ((1u << FINE_BITS) - 1u);
    at->speed_q56 += at->acceleration_q56 + 3 * j;
    at->acceleration_q56 += SIX * j;
    if (brake->first != 0) {
        brake->first--;
    } else if (brake->second != 0) {
        brake->second--;
    } else {
        brake->last--;
    }
}

/* speed n + (2 acceleration - peak) n^2 / 6 in the first part, peak n^2 / 6 in the last; the mean speed in the second. */
int64_t path_brake_way_q40_mm(const struct path_brake *brake)
{
    const int64_t n1 = brake->first;
    const int64_t n2 = brake->second;
    const int64_t n3 = brake->last;
    const int64_t down = brake->down_q56 * n1;
    const int64_t peak = brake->up_q56 * n3; /* a sixth of it */
    const int64_t even_from = brake->at.speed_q56 + 3 * (down - 2 * peak) * n1;
    const int64_t even_to = 3 * peak * n3;
    return (brake->at.speed_q56 >> FINE_BITS) * n1 +
           ((2 * down - 3 * peak) >> FINE_BITS) * n1 * n1 +
           ((even_from + even_to) >> (FINE_BITS + 1)) * n2 + (peak >> FINE_BITS) * n3 * n3;
}
