/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_piece.h (see there): instants and states of a feed piece in which a stop may begin. Used by
 * offline/stop_verdict and offline/stop_search. mm, s. Any thread of a host; the functions change their arguments
 * only. */
#include "offline/stop_piece.h"

#include <math.h>

#define EVEN_INSTANTS 129  /* of a piece, at equal distances */
#define ROWS_EACH     4    /* of the path, for an instant between them */
#define LEAST_MM_S    1e-4 /* slower is standstill */
/* of the shortest path stop: with more jerk the distance of one tick would matter */
#define LEAST_TICKS 6.0

/* Feed overrides at which path stops are followed, and the same shares of the piece's greatest. */
static const double SHARES[STOP_SHARES] = {1.0,         511.0 / 512, 509.0 / 512, 504.0 / 512,
                                           488.0 / 512, 448.0 / 512, 0.75,        320.0 / 512,
                                           0.5,         0.25,        0.1};

double stop_piece_value(const double c[8], double u, int order)
{
    double sum = 0.0;
    for (int k = 7; k >= order; k--) {
        double factor = 1.0;
        for (int i = 0; i < order; i++) {
            factor *= k - i;
        }
        sum = sum * u + factor * c[k];
    }
    return sum;
}

double stop_piece_powers(const struct program_piece *from, double c[8])
{
    double seconds = ldexp((double)from->duration_q32_s, -32);
    double unit = ldexp(seconds, -program_piece_exponent(from->duration_q32_s));
    double power = 1.0;
    c[0] = ldexp((double)from->start_q40_mm, -40);
    for (int k = 1; k <= 7; k++) {
        power *= unit;
        c[k] = ldexp((double)from->c_q40_mm[k - 1], -40) * power;
    }
    return seconds;
}

/* Adds an instant, u = 0 ... 1 over the piece, in ascending order; 0: there are too many. */
static int add_instant(const struct stop_setting *setting, const double c[8], double u,
                       struct stop_piece *piece)
{
    if (piece->count >= STOP_MOST_INSTANTS) {
        return 0;
    }
    struct stop_state *at = &piece->at[piece->count];
    at->s = stop_piece_value(c, u, 0);
    at->v = stop_greater(stop_piece_value(c, u, 1) / piece->seconds, 0.0);
    at->a = stop_piece_value(c, u, 2) / (piece->seconds * piece->seconds);
    piece->at_s[piece->count] = u * piece->seconds;
    piece->row[piece->count] = stop_row_at(&setting->lookup, at->s);
    piece->fastest.v = stop_greater(piece->fastest.v, at->v);
    piece->fastest.a = stop_greater(piece->fastest.a, at->a);
    piece->extreme.v = stop_greater(piece->extreme.v, at->v);
    piece->extreme.a = stop_greater(piece->extreme.a, fabs(at->a));
    piece->count++;
    return 1;
}

/* Adds the instants of a stretch, from the last one to u = high, at every `each`-th row of the path, no closer than
 * step_s: a bend may be shorter than the distance of the even instants. */
static int add_rows(const struct stop_setting *setting, const double c[8], double high,
                    uint32_t each, double step_s, struct stop_piece *piece)
{
    const double low = piece->at_s[piece->count - 1u] / piece->seconds;
    const double from = piece->at[piece->count - 1u].s;
    const double way = stop_piece_value(c, high, 0) - from;
    uint32_t row = piece->row[piece->count - 1u] + 1u;
    for (; row < setting->lookup.row_count && setting->lookup.rows[row].s_mm < from + way;
         row += each) {
        const double u =
            low + (high - low) * stop_greater(setting->lookup.rows[row].s_mm - from, 0.0) / way;
        const double last_s = piece->at_s[piece->count - 1u];
        if (u * piece->seconds >= last_s + step_s &&
            high * piece->seconds >= last_s + 2.0 * step_s && !add_instant(setting, c, u, piece)) {
            return 0;
        }
    }
    return 1;
}

/* 0: too many. */
static int add_instants(const struct stop_setting *setting, const double c[8], uint32_t each,
                        double step_s, struct stop_piece *piece)
{
    const double parts = fmin(stop_greater(ceil(piece->seconds / step_s), 2.0), EVEN_INSTANTS - 1);
    int fits = 1;
    piece->count = 0;
    piece->fastest.s = piece->fastest.v = piece->fastest.a = 0.0;
    piece->extreme = piece->fastest;
    for (int k = 0; k <= (int)parts && fits; k++) {
        if (k > 0 && piece->seconds > 2.0 * parts * step_s) {
            fits = add_rows(setting, c, k / parts, each, step_s, piece);
        }
        fits = fits && add_instant(setting, c, k / parts, piece);
    }
    return fits;
}

/* The greatest acceleration or jerk along the path that the extra axes can follow at one of the instants of a piece, by
 * the reciprocals of their limits. A rotary axis may turn by many degrees within a millimetre. */
static double extra_axes_most(const struct stop_setting *setting, const struct stop_piece *piece,
                              const double inverse[PROGRAM_AXES])
{
    double most = 0.0;
    for (uint32_t i = 0; i < piece->count; i++) {
        const double *by_mm = setting->lookup.bends[piece->row[i]].by_mm[0];
        double used = 0.0; /* share of a limit, for 1 along the path */
        for (uint32_t k = PROGRAM_SPACE; k < setting->lookup.axis_count; k++) {
            used = stop_greater(used, fabs(by_mm[k]) * inverse[k]);
        }
        most = stop_greater(most, used > 0.0 ? 1.0 / used : HUGE_VAL);
    }
    return most;
}

/* The same where there are extra axes, and no more than this value. */
static double followed_most(const struct stop_setting *setting, const struct stop_piece *piece,
                            const double inverse[PROGRAM_AXES], double most)
{
    return setting->lookup.axis_count > PROGRAM_SPACE
               ? fmin(most, extra_axes_most(setting, piece, inverse))
               : most;
}

/* The greatest codes of a piece. They allow a stop within LEAST_TICKS from its greatest speed, or on the remaining path
 * if that needs higher codes; but no more than the extra axes can follow. */
static void piece_most(const struct stop_setting *setting, struct stop_piece *piece)
{
    const double span_s = LEAST_TICKS * setting->period_s;
    const double left_mm = stop_greater(setting->length_mm - piece->at[piece->count - 1u].s, 0.0);
    const double needed =
        stop_greater(8.0 * stop_greater(piece->fastest.v, LEAST_MM_S), left_mm / span_s) / span_s;
    const double acceleration =
        followed_most(setting, piece, setting->inverse.axis_acceleration, needed);
    const double jerk =
        followed_most(setting, piece, setting->inverse.axis_jerk, needed / (2.0 * span_s));
    for (int k = 0; k < 3; k++) {
        const double most = k == 1 ? acceleration : jerk;
        piece->most[k] = setting->most[k];
        while (piece->most[k] > 1 && stop_number_of(k, piece->most[k]) > most) {
            piece->most[k]--;
        }
    }
}

void stop_piece_fill(const struct stop_setting *setting, const struct program *p, uint32_t i,
                     double left_s, double step_s, struct stop_piece *piece)
{
    struct program_piece from;
    double c[8];
    program_piece_get(p, i, &from);
    piece->seconds = stop_piece_powers(&from, c);
    piece->suspect = 0;
    piece->first_fails = 0;
    piece->suspect_override = (struct stop_overridden){0, 0, -1};
    piece->suspect_before = (struct stop_overridden){0, 0, 0};
    piece->left_s = left_s;
    piece->factor = ldexp((double)from.override_factor_q24, -24);
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        piece->level[k] =
            k == PROGRAM_LEVEL_FULL ? piece->factor : ldexp((double)program_level_q9(k), -9);
        piece->slope[k] = ldexp((double)program_number(from.override.rate[k]), -32);
        piece->second[k] = ldexp((double)program_number(from.override.second[k]), -24);
    }
    uint32_t each = ROWS_EACH;
    while (!add_instants(setting, c, each, step_s, piece)) {
        each *= 2u;
    }
    piece_most(setting, piece);
    double little = setting->rise_is_cut ? 0.25 * setting->deceleration : HUGE_VAL;
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        double rate = piece->level[k];
        double slope = fmin(piece->slope[k], sqrt(rate * piece->second[k])) * piece->fastest.v;
        most = stop_greater(most, piece->fastest.a * rate * rate + fmin(slope, little));
    }
    piece->fastest.v *= piece->factor;
    piece->fastest.a = most;
}

/* Greatest override rate at an override, of a rise (sign 1) or a fall (-1): it began at a constant override, and can
 * end at one within the level. */
static double slope_at(const struct stop_piece *piece, double rate, int sign)
{
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        if (rate <= piece->level[k]) {
            double room = sign > 0 ? fmin(rate, piece->level[k] - rate) : rate;
            most = stop_greater(most, fmin(piece->slope[k], sqrt(2.0 * room * piece->second[k])));
        }
    }
    return most;
}

double stop_greatest_slope(const struct stop_piece *piece)
{
    double most = 0.0;
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        most = stop_greater(most,
                            fmin(piece->slope[k], sqrt(2.0 * piece->level[k] * piece->second[k])));
    }
    return most;
}

double stop_weight_s(const struct stop_piece *piece, uint32_t i)
{
    const uint32_t last = piece->count - 1u;
    return 0.5 * (piece->at_s[i < last ? i + 1u : last] - piece->at_s[i > 0u ? i - 1u : 0u]);
}

/* Feed override number r = 0 ... 2 STOP_SHARES - 1 of a piece. */
static double stop_override_at(const struct stop_piece *piece, uint32_t r)
{
    return r < STOP_SHARES ? SHARES[r] : piece->factor * SHARES[r - STOP_SHARES];
}

int stop_overridden_state(const struct stop_piece *piece, const struct stop_overridden *which,
                          double little, struct stop_state *from)
{
    const double rate = stop_override_at(piece, which->rate);
    if ((which->rate >= STOP_SHARES && rate <= 1.0) ||
        (which->slope > 0 && rate >= piece->factor)) {
        return 0;
    }
    *from = piece->at[which->instant];
    const double change = slope_at(piece, rate, which->slope) * from->v;
    const double more = which->slope < 0 ? -change : which->slope > 0 ? fmin(change, little) : 0.0;
    from->a = rate * rate * from->a + more;
    from->v *= rate;
    return 1;
}

void stop_overridden_most(const struct stop_piece *piece, uint32_t r, double little, double *speed,
                          double *rise, double *fall)
{
    const double rate = stop_override_at(piece, r);
    const double a = rate * rate * piece->extreme.a;
    *speed = rate * piece->extreme.v;
    *rise = a + fmin(slope_at(piece, rate, 1) * piece->extreme.v, little);
    *fall = a + slope_at(piece, rate, -1) * piece->extreme.v;
}
