/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_verdict.h (see there): whether path stops with given codes keep the limits from all of a feed
 * piece. Used by offline/stop_search. Any thread of a host; the functions change their arguments only. */
#include "offline/stop_verdict.h"

#include <math.h>

#define STEP_S         0.002  /* between two samples of a path stop, */
#define FINE_S         0.0005 /* and in the strict test */
#define BRAKE_EACH     5      /* ticks of a path stop that another may replace, */
#define BRAKE_INSTANTS 16u    /* and instants at which it has begun, about */
#define LONGEST_SHARE  0.1    /* of the longest path stop in the cost of codes */
#define FAR_TICKS                                                                                  \
    20.0 /* and twice the path stop: so far from its end a path stop fits before the end of the program */
#define NO_BRAKE_S 10.0 /* longest path stop in the cost of codes with which none begins */

/* What a path stop has to keep; `surely`: it does. */
struct keeping {
    const struct stop_inverse *inverse;
    int surely;
};

int stop_times_of(const struct stop_setting *setting, const struct stop_piece *piece,
                  const struct path_brake_numbers *numbers, double after_s,
                  struct stop_times *times)
{
    struct path_brake brake;
    double sum = 0.0;
    times->first_s = after_s;
    times->worst_s = 0.0;
    for (uint32_t i = piece->count; i > 0; i--) {
        const struct stop_state *at = &piece->at[i - 1u];
        double next_s = i == piece->count ? piece->seconds : piece->at_s[i];
        double wait = times->first_s + (next_s - piece->at_s[i - 1u]);
        double left = piece->left_s + (piece->seconds - piece->at_s[i - 1u]);
        /* A path stop that is longer than the remaining program is not begun. The next instant may have a better one.
         * It is not counted, otherwise the worst numbers would be the best. */
        int begins = stop_brake_begin(&brake, at, numbers, setting->period_s);
        double total_s = begins ? stop_brake_time(at, numbers, setting->period_s) : STOP_NEVER_S;
        if (begins && at->v * piece->factor > 0.5 * piece->fastest.v &&
            left > 2.0 * total_s + FAR_TICKS * setting->period_s &&
            !stop_fits_before_end(setting, at, numbers)) {
            return 0;
        }
        times->brakes[i - 1u] = total_s < left;
        times->first_s = total_s < left ? total_s : begins ? left : wait;
        times->worst_s = stop_greater(times->worst_s, times->first_s);
        sum += times->first_s * stop_weight_s(piece, i - 1u);
    }
    times->mean_s = sum / piece->seconds;
    times->longest_s = stop_brake_begin(&brake, &piece->fastest, numbers, setting->period_s)
                           ? stop_brake_time(&piece->fastest, numbers, setting->period_s)
                           : NO_BRAKE_S;
    times->cost_s = times->mean_s + LONGEST_SHARE * times->longest_s;
    return 1;
}

/* Bounds of the states in which path stops begin: greatest speed, and greatest acceleration of either sign. */
struct begun {
    double speed, rise, fall;
};

/* Bounds of all path stops that begin in the piece in states within these; returns the arc length of their end at most.
 * */
static double begun_extent(const struct stop_setting *setting, const struct stop_piece *piece,
                           const struct path_brake_numbers *numbers, const struct begun *begun,
                           struct stop_extent *extent)
{
    const struct stop_state most = {piece->at[piece->count - 1u].s, begun->speed, begun->rise};
    const double to_mm = stop_brake_extent(setting, numbers, &most, begun->fall, extent);
    stop_stretch_from(&setting->lookup, piece->row[0], to_mm, &extent->path);
    return to_mm;
}

/* The states at any override. */
static struct begun begun_at_any_rate(const struct stop_setting *setting,
                                      const struct stop_piece *piece)
{
    const struct stop_piece *close = piece->close;
    const double rate = stop_greater(piece->factor, 1.0);
    const double v = stop_greater(piece->extreme.v, close->extreme.v);
    const double a = stop_greater(piece->extreme.a, close->extreme.a) * rate * rate;
    const double change = stop_greatest_slope(piece) * v;
    const double little = setting->rise_is_cut ? 0.25 * setting->deceleration : HUGE_VAL;
    const struct begun out = {v * rate, a + stop_lesser(change, little), a + change};
    return out;
}

/* Whether bounds alone show that all path stops from such states keep the limits. */
static int begun_keep(const struct stop_setting *setting, const struct stop_inverse *inverse,
                      const struct stop_piece *piece, const struct path_brake_numbers *numbers,
                      const struct begun *begun)
{
    struct stop_extent extent;
    (void)begun_extent(setting, piece, numbers, begun, &extent);
    return stop_extent_keeps(&setting->lookup, inverse, &extent);
}

int stop_all_keep(const struct stop_setting *setting, struct stop_piece *piece,
                  const struct stop_times *times, const struct path_brake_numbers *numbers)
{
    const struct begun begun = {piece->extreme.v, piece->extreme.a, piece->extreme.a};
    if (begun_keep(setting, &setting->inverse, piece, numbers, &begun)) {
        return 1;
    }
    for (uint32_t n = 0; n < piece->count; n++) {
        uint32_t i = (n + piece->suspect) % piece->count;
        struct path_brake brake;
        if (times->brakes[i] &&
            stop_brake_begin(&brake, &piece->at[i], numbers, setting->period_s) &&
            !stop_brake_keeps(setting, &setting->inverse, &brake, piece->at[i].s, piece->row[i],
                              STEP_S)) {
            piece->suspect = i;
            return 0;
        }
    }
    return 1;
}

/* Whether a path stop fits and keeps the limits, or need not fit. */
static int state_keeps(const struct stop_setting *setting, const struct keeping *keeping,
                       const struct stop_state *at, uint32_t row,
                       const struct path_brake_numbers *numbers)
{
    struct path_brake brake;
    if (!stop_brake_begin(&brake, at, numbers, setting->period_s)) {
        return stop_may_wait(setting, at, numbers);
    }
    return keeping->surely ||
           stop_brake_keeps(setting, keeping->inverse, &brake, at->s, row, FINE_S);
}

/* A quarter of the deceleration. */
static double quarter(const struct stop_setting *setting, const struct path_brake_numbers *numbers)
{
    return 0.25 * (double)numbers->deceleration_q56 * 0x1p-56 /
           (setting->period_s * setting->period_s);
}

/* Whether a path stop from this state fits and keeps the limits, or need not fit; 1 for a state that cannot occur. */
static int overridden_keeps(const struct stop_setting *setting, const struct stop_piece *piece,
                            const struct keeping *keeping, const struct stop_overridden *which,
                            const struct path_brake_numbers *numbers)
{
    const double little = setting->rise_is_cut ? quarter(setting, numbers) : HUGE_VAL;
    const uint32_t row = piece->row[which->instant];
    struct stop_state from;
    if (!stop_overridden_state(piece, which, little, &from)) {
        return 1;
    }
    return (!keeping->surely && stop_usage(&setting->lookup, keeping->inverse,
                                           &setting->lookup.rows[row], &from, 0.0) > 1.0) ||
           state_keeps(setting, keeping, &from, row, numbers);
}

/* Fills for each feed override whether bounds alone show that path stops at it keep the limits: most do at low ones. */
static void rates_surely_keep(const struct stop_setting *setting,
                              const struct stop_inverse *inverse, const struct stop_piece *piece,
                              const struct path_brake_numbers *numbers,
                              uint8_t surely[2u * STOP_SHARES])
{
    const double little = setting->rise_is_cut ? quarter(setting, numbers) : HUGE_VAL;
    for (uint32_t rate = 0; rate < 2u * STOP_SHARES; rate++) {
        struct begun begun;
        stop_overridden_most(piece, rate, little, &begun.speed, &begun.rise, &begun.fall);
        surely[rate] = (uint8_t)begun_keep(setting, inverse, piece, numbers, &begun);
    }
}

/* The same limits at other feed overrides, also while the override changes. */
static int overrides_keep(const struct stop_setting *setting, struct stop_piece *piece,
                          const struct keeping *all, const struct path_brake_numbers *numbers)
{
    struct stop_overridden which = piece->suspect_override;
    uint8_t surely[2u * STOP_SHARES] = {0};
    if (!all->surely) {
        rates_surely_keep(setting, all->inverse, piece, numbers, surely);
    }
    for (uint32_t n = 0; n < piece->count; n++) {
        for (which.rate = 0; which.rate < 2u * STOP_SHARES; which.rate++) {
            const struct keeping keeping = {all->inverse, all->surely || surely[which.rate]};
            for (which.slope = -1; which.slope <= 1; which.slope++) {
                if (!overridden_keeps(setting, piece, &keeping, &which, numbers)) {
                    piece->suspect_override = which;
                    return 0;
                }
            }
        }
        which.instant = which.instant + 1u < piece->count ? which.instant + 1u : 0u;
    }
    return 1;
}

/* The same at override 1 from instants close to each other. */
static int close_keep(const struct stop_setting *setting, struct stop_piece *close,
                      const struct path_brake_numbers *numbers, int surely)
{
    const struct begun begun = {close->extreme.v, close->extreme.a, close->extreme.a};
    const struct keeping keeping = {
        &setting->inverse,
        surely || begun_keep(setting, &setting->inverse, close, numbers, &begun)};
    for (uint32_t n = 0; n < close->count; n++) {
        uint32_t i = (n + close->suspect) % close->count;
        if (!state_keeps(setting, &keeping, &close->at[i], close->row[i], numbers)) {
            close->suspect = i;
            return 0;
        }
    }
    return 1;
}

/* Whether a path stop keeps the limits that replaces one with the numbers `before`, begun in this state. */
static int out_of_brake_keeps(const struct stop_setting *setting, const struct stop_state *from,
                              uint32_t row, const struct path_brake_numbers *before,
                              const struct path_brake_numbers *numbers)
{
    struct path_brake first;
    struct path_brake second;
    if (!stop_brake_begin(&first, from, before, setting->period_s)) {
        return 1;
    }
    path_brake_first(&first);
    for (uint32_t k = 1; !path_brake_ended(&first); k++) {
        if (k % BRAKE_EACH == 0u && path_brake_begin(&second, &first.at, numbers) &&
            !stop_brake_keeps(setting, &setting->at_any_rate, &second, from->s, row, FINE_S)) {
            return 0;
        }
        path_brake_step(&first);
    }
    return 1;
}

/* From one instant and override. A feed hold first cuts a rise. */
static int out_of_overridden_keeps(const struct stop_setting *setting,
                                   const struct stop_piece *piece,
                                   const struct stop_overridden *which,
                                   const struct path_brake_numbers *before,
                                   const struct path_brake_numbers *numbers)
{
    struct stop_state from;
    return !stop_overridden_state(piece, which, quarter(setting, before), &from) ||
           out_of_brake_keeps(setting, &from, piece->row[which->instant], before, numbers);
}

/* Whether bounds alone show the same for all states at a feed override. */
static int out_of_brakes_surely_keep(const struct stop_setting *setting,
                                     const struct stop_piece *piece, uint32_t rate,
                                     const struct path_brake_numbers *before,
                                     const struct path_brake_numbers *numbers)
{
    struct stop_extent extent;
    struct begun begun;
    stop_overridden_most(piece, rate, quarter(setting, before), &begun.speed, &begun.rise,
                         &begun.fall);
    const double from_mm = begun_extent(setting, piece, before, &begun, &extent);
    const struct stop_state most = {from_mm, extent.speed, begun.rise};
    const double fall = extent.acceleration;
    const double to_mm = stop_brake_extent(setting, numbers, &most, fall, &extent);
    stop_stretch_from(&setting->lookup, piece->row[0], to_mm, &extent.path);
    return stop_extent_keeps(&setting->lookup, &setting->at_any_rate, &extent);
}

/* From some instants at a feed override, also while it changes. */
static int out_of_rate_keeps(const struct stop_setting *setting, struct stop_piece *piece,
                             uint32_t rate, const struct path_brake_numbers *before,
                             const struct path_brake_numbers *numbers)
{
    struct stop_overridden which = {0, rate, 0};
    const uint32_t each = 1u + piece->count / BRAKE_INSTANTS;
    if (out_of_brakes_surely_keep(setting, piece, rate, before, numbers)) {
        return 1;
    }
    for (; which.instant < piece->count; which.instant += each) {
        for (which.slope = -1; which.slope <= 1; which.slope++) {
            if (!out_of_overridden_keeps(setting, piece, &which, before, numbers)) {
                piece->suspect_before = which;
                return 0;
            }
        }
    }
    return 1;
}

/* At all overrides; the state that broke a limit last is evaluated first. */
int stop_out_of_brakes_keeps(const struct stop_setting *setting, struct stop_piece *piece,
                             const int codes[3])
{
    struct path_brake_numbers numbers;
    struct path_brake_numbers before;
    if (piece->before[1] == 0 || !stop_numbers_of(setting, piece->before, &before)) {
        return 1;
    }
    if (!stop_numbers_of(setting, codes, &numbers) ||
        !out_of_overridden_keeps(setting, piece, &piece->suspect_before, &before, &numbers)) {
        return 0;
    }
    for (uint32_t rate = 0; rate < 2u * STOP_SHARES; rate++) {
        if (!out_of_rate_keeps(setting, piece, rate, &before, &numbers)) {
            return 0;
        }
    }
    return 1;
}

int stop_within(const struct stop_piece *piece, const int codes[3])
{
    for (int k = 0; k < 3; k++) {
        if (codes[k] < 1 || codes[k] < piece->most[k] - STOP_FEWER || codes[k] > piece->most[k]) {
            return 0;
        }
    }
    return 1;
}

int stop_suspect_keeps(const struct stop_setting *setting, const struct stop_piece *piece,
                       const struct path_brake_numbers *numbers)
{
    const struct keeping keeping = {&setting->at_any_rate, 0};
    return overridden_keeps(setting, piece, &keeping, &piece->suspect_override, numbers);
}

int stop_strictly(const struct stop_setting *setting, struct stop_piece *piece, const int codes[3])
{
    const struct stop_inverse *inverse = &setting->at_any_rate;
    struct path_brake_numbers numbers;
    if (!stop_numbers_of(setting, codes, &numbers) ||
        !stop_suspect_keeps(setting, piece, &numbers)) {
        return 0;
    }
    const struct begun begun = begun_at_any_rate(setting, piece);
    struct stop_extent extent;
    (void)begun_extent(setting, piece, &numbers, &begun, &extent);
    const struct keeping keeping = {inverse, stop_extent_keeps(&setting->lookup, inverse, &extent)};
    const int surely = stop_extent_keeps(&setting->lookup, &setting->inverse, &extent);
    return close_keep(setting, piece->close, &numbers, surely) &&
           overrides_keep(setting, piece, &keeping, &numbers) &&
           stop_out_of_brakes_keeps(setting, piece, codes);
}
