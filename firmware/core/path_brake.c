/* SPDX-License-Identifier: MIT */
/* Implements core/path_brake.h (see there): a path stop: an S-curve of path speed, decided anew in each tick. Used by
 * core/feed_override, and by sim/offline to search stop parameters. Changes its struct only; any context. */
#include "core/path_brake.h"

#include "core/qmath.h"

#define FINE_BITS        16 /* from q40 to q56 */
#define MOST_Q56         ((int64_t)1 << 60)
#define MOST_BITS        12         /* of PATH_BRAKE_MOST_TICKS */
#define SIXTH_Q32        715827882u /* 1/6 */
#define THREE_HALVES_Q16 98304u     /* 3/2 */
#define SPARE_HALVES     3          /* half ticks of path_brake_fits that whole ticks take more */
#define ONE_TICK_Q16     65536u
#define RISE_BITS 7 /* of an acceleration at which a path stop begins, over its deceleration */
#define LEAST     (1 << 22) /* 2^-34 mm a tick squared, or cubed */
#define FITS_BITS 57        /* of a deceleration in path_brake_fits */

enum phase { FALLING, READY, SETTLING, RESTING };

/* --- Numbers of the stop table (docs/reference/protocol.md 1.4) --- */

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
    const struct path_brake_numbers n = {
        decoded(stop->jerk_down, CUBED_MS_Q61, 3 * p - 23),
        decoded(stop->deceleration, SQUARED_MS_Q51, 2 * p - 19),
        decoded(stop->jerk_up, CUBED_MS_Q61, 3 * p - 23),
    };
    const int64_t jerk = qmath_lesser(n.jerk_down_q56, n.jerk_up_q56);
    if (jerk < LEAST || n.deceleration_q56 < LEAST || n.deceleration_q56 >> MOST_BITS >= jerk) {
        return 0;
    }
    *out = n;
    return 1;
}

/* --- Products of numbers that need more than 64 bits --- */

/* A number above 0: mantissa 2^exponent, the mantissa of 31 bits and rounded down. */
struct rough {
    uint32_t mantissa;
    int exponent;
};

static struct rough rough_of(int64_t a)
{
    const int zeros = qmath_clz64((uint64_t)a | 1u);
    const struct rough out = {(uint32_t)((uint64_t)a << zeros >> 33), 33 - zeros};
    return out;
}

/* need <= 2 a b 2^up for a need below 2^63; 0 where rounding leaves it open. */
static int within(uint64_t need, struct rough a, struct rough b, int up)
{
    const uint64_t have = 2u * qmath_product_unsigned(a.mantissa, b.mantissa);
    const int shift = a.exponent + b.exponent + up;
    if (shift >= 0) {
        return shift > 63 || have > need >> shift;
    }
    return shift >= -63 && have >> -shift >= need;
}

/* Whether whole ticks are enough for the release phase: b^2 <= 2 j (v - b); for v less b, also a tick later
 * (docs/theory/numerics.md section 12). */
static int may_settle(int64_t speed_q56, int64_t fall_q56, int64_t jerk_q56)
{
    if (speed_q56 <= fall_q56) {
        return 0;
    }
    const struct rough fall = rough_of(fall_q56);
    const uint64_t need = qmath_product_unsigned(fall.mantissa + 1u, fall.mantissa + 1u);
    return within(need, rough_of(speed_q56 - fall_q56), rough_of(jerk_q56), -2 * fall.exponent);
}

/* --- Begin --- */

/* Neither too slow nor too fast, and no part of the path stop takes more than PATH_BRAKE_MOST_TICKS. */
static int in_range(const struct path_state *from, const struct path_brake_numbers *n)
{
    const int64_t rise = qmath_greater(from->acceleration_q56, 0);
    return from->speed_q56 >= PATH_BRAKE_NO_SPEED && from->speed_q56 <= PATH_BRAKE_MOST_SPEED &&
           from->acceleration_q56 >= -MOST_Q56 &&
           from->speed_q56 >> MOST_BITS < n->deceleration_q56 &&
           rise >> MOST_BITS < n->jerk_down_q56 && rise >> RISE_BITS < n->deceleration_q56 &&
           rise <= MOST_Q56 && (rise >> 30) * (rise >> 30) <= n->jerk_down_q56;
}

/* Whether the acceleration may fall in the next tick: a release phase is still possible after one more without jerk. */
static int may_fall(const struct path_state *at, int64_t jerk_up_q56)
{
    const int64_t a = at->acceleration_q56;
    return a >= 0 || may_settle(at->speed_q56 + a, -a, jerk_up_q56);
}

int path_brake_begin(struct path_brake *brake, const struct path_state *from,
                     const struct path_brake_numbers *numbers)
{
    if (!in_range(from, numbers)) {
        return 0;
    }
    const struct path_state next = {.speed_q56 = from->speed_q56 + from->acceleration_q56,
                                    .acceleration_q56 = from->acceleration_q56};
    if (!may_fall(&next, numbers->jerk_up_q56)) {
        return 0;
    }
    brake->at = *from;
    brake->numbers = *numbers;
    brake->settle_ticks = 0;
    brake->phase = FALLING;
    return 1;
}

/* --- How deep --- */

/* sqrt(9/4 + 2 w/j) in 2^-16 for 2 < w/j < 2^29: below it by 2^-8 of it at most. */
static uint32_t depth_root_q16(int64_t w_q56, int64_t jerk_q56)
{
    const struct rough w = rough_of(w_q56);
    const struct rough j = rough_of(jerk_q56);
    const uint32_t ratio_q15 = w.mantissa / ((j.mantissa >> 15) + 1u);
    const uint64_t square_q32 =
        ((uint64_t)9 << 30) + ((uint64_t)ratio_q15 << ((w.exponent - j.exponent + 18) & 63));
    const int even = qmath_clz64(square_q32) & ~1;
    const uint32_t root = qmath_root_above((uint32_t)(square_q32 << even >> 32));
    return (root - (root >> 9) - 3u) << 16 >> (even / 2);
}

/* Nearly the greatest deceleration b that a tick may bring the acceleration to, b^2 + 3 j b <= 2 j w with w = speed +
 * acceleration / 2, w > 0: the speed then is w - b / 2, and may_settle. */
static int64_t depth(int64_t w_q56, int64_t jerk_q56)
{
    if (w_q56 >> 1 <= jerk_q56) {
        return w_q56 >> 1;
    }
    return qmath_mul_unsigned(jerk_q56, depth_root_q16(w_q56, jerk_q56) - THREE_HALVES_Q16) * 65536;
}

/* --- A bound of the distance --- */

/* The time in which a jerk makes an acceleration, at least a / j in 2^-16 ticks; held at 2^32 - 1. */
static uint32_t ramp_ticks_q16(int64_t a_q56, int64_t jerk_q56)
{
    const struct rough a = rough_of(a_q56);
    const struct rough j = rough_of(jerk_q56);
    const int64_t ratio_q15 = a.mantissa / (j.mantissa >> 15) + 1u;
    const int64_t ticks_q16 = qmath_shift_clamp(ratio_q15, a.exponent - j.exponent + 1) + 1;
    return ticks_q16 >> 32 != 0 ? UINT32_MAX : (uint32_t)ticks_q16;
}

/* a t, for t in 2^-16; at most 2^-47 of it too small. */
static int64_t over_ticks(int64_t a_q56, uint32_t ticks_q16)
{
    return qmath_shift_clamp(qmath_mul_unsigned(a_q56, ticks_q16), 16);
}

/* x^2 + 3/8 y^2 <= 2 a distance */
static int squares_within(int64_t x, int64_t y, int64_t a_q56, int64_t distance_q40_mm)
{
    const int up = qmath_clz64((uint64_t)qmath_greater(x, y));
    const uint32_t first = (uint32_t)((uint64_t)x << up >> 33) + 1u;
    const uint32_t second = (uint32_t)((uint64_t)y << up >> 33) + 1u;
    const uint64_t part = qmath_product_unsigned(second, second) >> 3;
    const uint64_t need = qmath_product_unsigned(first, first) + 3u * part + 3u;
    return within(need, rough_of(a_q56), rough_of(distance_q40_mm), FINE_BITS - 2 * (33 - up));
}

/* a^2 / (2 j): the speed that an acceleration makes while it goes to 0. */
static int64_t speed_of_rise(int64_t a_q56, int64_t jerk_q56)
{
    return over_ticks(a_q56, ramp_ticks_q16(a_q56, jerk_q56)) / 2;
}

/* x^2 + 3/8 y^2 <= 2 a distance, for the distance to standstill from the end of an onset `fall`. */
static int ends_within(const struct path_brake_numbers *numbers, int64_t speed_q56,
                       int64_t fall_q56, int64_t most_q56, int64_t distance_q40_mm)
{
    /* the parts of speed, a t / 2, and distance, a t^2 / 6, of the first jerk in t ticks */
    const uint32_t exact_q16 = ramp_ticks_q16(fall_q56, numbers->jerk_down_q56);
    const uint32_t first_q16 = exact_q16 > ONE_TICK_Q16 ? exact_q16 : ONE_TICK_Q16;
    const int64_t early = over_ticks(fall_q56, first_q16) / 2;
    const int64_t saved = qmath_third(over_ticks(early, first_q16 - (first_q16 >> 10)));
    const int64_t late = speed_of_rise(most_q56, numbers->jerk_up_q56);
    if ((early | late) >> 60 != 0) {
        return 0;
    }
    return squares_within(speed_q56 + early, late, most_q56,
                          distance_q40_mm + (saved >> FINE_BITS));
}

/* The distance is at most that with the deceleration alone from a higher speed, and that of the last jerk
 * (docs/theory/numerics.md section 12); the deceleration is one that is about reached. */
int path_brake_fits(const struct path_state *from, const struct path_brake_numbers *numbers,
                    int64_t distance_q40_mm)
{
    const int64_t a = from->acceleration_q56;
    if (!in_range(from, numbers) || a >> FITS_BITS > 0 || -a >> FITS_BITS > 0) {
        return 0;
    }
    const int64_t rise = qmath_greater(a, 0);
    const int64_t turned = speed_of_rise(qmath_magnitude(a), numbers->jerk_down_q56);
    if (turned >= MOST_Q56) {
        return 0;
    }
    const int64_t speed = from->speed_q56 + rise / 2;
    const int64_t greatest = speed + (a > 0 ? turned : 0);
    const int64_t left_q40_mm = distance_q40_mm - (SPARE_HALVES * greatest >> (FINE_BITS + 1));
    const int64_t jerk = qmath_lesser(numbers->jerk_down_q56, numbers->jerk_up_q56);
    const int64_t reached =
        qmath_greater(depth((from->speed_q56 + turned) >> 1, jerk), from->speed_q56 >> MOST_BITS);
    const int64_t most = qmath_lesser(numbers->deceleration_q56, reached);
    if (left_q40_mm <= 0 || most >> FITS_BITS != 0) {
        return 0;
    }
    return ends_within(numbers, speed, qmath_greater(most + a, 0), most, left_q40_mm);
}

/* --- Tick --- */

/* A tick with six times this jerk. */
static void move(struct path_state *at, int64_t sixth_q56)
{
    const int64_t a = at->acceleration_q56;
    const int64_t step_q56 = at->speed_q56 + (a >> 1) + sixth_q56 + (int64_t)at->fine_q56_mm;
    at->arc_length_q40_mm += step_q56 >> FINE_BITS;
    at->fine_q56_mm = (uint32_t)step_q56 & ((1u << FINE_BITS) - 1u);
    at->speed_q56 += a + 3 * sixth_q56;
    at->acceleration_q56 = a + 6 * sixth_q56;
}

/* A sixth, rounded towards 0: less by 2^-30 of it and a unit at most. */
static int64_t sixth_of(int64_t a)
{
    return a < 0 ? -qmath_mul_unsigned(-a, SIXTH_Q32) : qmath_mul_unsigned(a, SIXTH_Q32);
}

/* Towards the deceleration, as far as a release phase is still possible. */
static void fall_tick(struct path_brake *brake)
{
    const struct path_brake_numbers *n = &brake->numbers;
    const int64_t a = brake->at.acceleration_q56;
    const int64_t left = -(n->deceleration_q56 + a);
    const int64_t jerk =
        left < 0 ? qmath_greater(left, -n->jerk_down_q56) : qmath_lesser(left, n->jerk_down_q56);
    struct path_state next = brake->at;
    move(&next, sixth_of(jerk));
    if (may_fall(&next, n->jerk_up_q56)) {
        brake->at = next;
        return;
    }
    const int64_t most = depth(brake->at.speed_q56 + (a >> 1), n->jerk_up_q56) + a;
    move(&brake->at, jerk < 0 && most > 0 ? sixth_of(qmath_greater(jerk, -most)) : 0);
    brake->phase = READY;
}

/* The release phase: n ticks, n >= 2 v / b, with the jerks 6 (p - q i), i = 0 ... n - 1. Speed and acceleration are
 * reduced by the rounding error (docs/theory/numerics.md section 12). */
static void settle(struct path_brake *brake)
{
    const uint64_t speed = (uint64_t)brake->at.speed_q56;
    const uint64_t fall = (uint64_t)-brake->at.acceleration_q56;
    const uint64_t n = qmath_div_up_u64(2u * speed, fall);
    const uint64_t more = n * fall - 2u * speed; /* below fall */
    const uint64_t q = qmath_div_u64(more, n * (n * n - 1u));
    const uint64_t p = qmath_div_u64(speed + q * (n * (n - 1u) / 2u * (4u * n + 1u)), 3u * n * n);
    const int64_t steady = (int64_t)(6u * n * p);
    brake->rise_q56 = (int64_t)p;
    brake->rise_less_q56 = (int64_t)q;
    brake->settle_ticks = (uint32_t)n;
    brake->at.acceleration_q56 = 3 * (int64_t)(q * n * (n - 1u)) - steady;
    brake->at.speed_q56 = (int64_t)(3u * n * n * p - q * (n * (n - 1u) / 2u * (4u * n + 1u)));
    brake->phase = SETTLING;
}

static void settle_tick(struct path_brake *brake)
{
    move(&brake->at, brake->rise_q56);
    brake->rise_q56 -= brake->rise_less_q56;
    brake->settle_ticks--;
    if (brake->settle_ticks == 0) {
        brake->phase = RESTING;
    }
}

void path_brake_first(struct path_brake *brake)
{
    const int64_t rise = qmath_greater(brake->at.acceleration_q56, 0);
    move(&brake->at, -sixth_of(qmath_lesser(rise, brake->numbers.jerk_down_q56)));
}

void path_brake_step(struct path_brake *brake)
{
    if (brake->phase == FALLING) {
        fall_tick(brake);
        return;
    }
    if (brake->phase == READY) {
        settle(brake);
    }
    if (brake->phase == SETTLING) {
        settle_tick(brake);
    }
}

int path_brake_ended(const struct path_brake *brake)
{
    return brake->phase == RESTING;
}
