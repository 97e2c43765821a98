/* SPDX-License-Identifier: MIT */
/* Implements offline/stop_search.h (see there): the search of stop parameters for each feed piece. Called by
 * host_tools/hodograph/native. Any thread; the functions change their arguments only. */
#include "offline/stop_search.h"

#include <math.h>
#include <string.h>

#include "offline/stop_brake.h"
#include "offline/stop_piece.h"
#include "offline/stop_verdict.h"

#define GREATEST_CODE 255 /* codes of jerk and deceleration are bytes */
/* A piece gets no path stop if waiting for that of the next piece takes a share of the path stop's mean time below: */
#define WAIT_BETTER  0.8   /* this; */
#define WAIT_AS_GOOD 1.001 /* or this, if the path stop could also take much longer */
/* times the least time without limits: codes that take at most this are not searched for from other starts */
#define NEAR 1.05

struct choice {
    int codes[3];
    double cost_s, longest_s, mean_s, worst_s, first_s;
};

/* Takes the codes if they are better; `strict`: at all overrides, and at more instants. The state in which other codes
 * broke a limit last is evaluated first, except where the first test failed last: it then usually fails again, and
 * costs less than a path stop that keeps the limits. */
static int better(const struct stop_setting *setting, struct stop_piece *piece, const int codes[3],
                  double after_s, int strict, struct choice *best)
{
    struct path_brake_numbers numbers;
    struct stop_times times;
    if (!stop_within(piece, codes) || !stop_numbers_of(setting, codes, &numbers)) {
        return 0;
    }
    if (strict && !piece->first_fails && !stop_suspect_keeps(setting, piece, &numbers)) {
        return 0;
    }
    if (!stop_times_of(setting, piece, &numbers, after_s, &times) || times.cost_s >= best->cost_s) {
        return 0;
    }
    piece->first_fails = !stop_all_keep(setting, piece, &times, &numbers);
    if (piece->first_fails || (strict && !stop_strictly(setting, piece, codes))) {
        return 0;
    }
    memcpy(best->codes, codes, sizeof best->codes);
    best->cost_s = times.cost_s;
    best->longest_s = times.longest_s;
    best->mean_s = times.mean_s;
    best->worst_s = times.worst_s;
    best->first_s = times.first_s;
    return 1;
}

static void climb(const struct stop_setting *setting, struct stop_piece *piece, double after_s,
                  int strict, int first, struct choice *best)
{
    static const int8_t ways[][3] = {{1, 1, 1},  {0, 1, 0},  {0, 0, 1},  {1, 0, 0},  {0, 1, 1},
                                     {1, 1, 0},  {1, 0, 1},  {1, -1, 0}, {-1, 1, 0}, {0, 1, -1},
                                     {0, -1, 1}, {1, 0, -1}, {-1, 0, 1}};
    for (int step = first; step >= 1; step /= 2) {
        for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
            int codes[3];
            int taken = 1;
            while (taken) {
                for (int k = 0; k < 3; k++) {
                    codes[k] = best->codes[k] + step * ways[i][k];
                    codes[k] = codes[k] > piece->most[k] && ways[i][k] > 0 &&
                                       best->codes[k] < piece->most[k]
                                   ? piece->most[k]
                                   : codes[k];
                }
                taken = better(setting, piece, codes, after_s, strict, best);
            }
        }
    }
}

/* Lowers all codes until the limits are kept at all overrides; 0: they never are. */
static int lowered(const struct stop_setting *setting, struct stop_piece *piece, const int start[3],
                   double after_s, struct choice *best)
{
    for (int down = 0; down <= GREATEST_CODE; down += down < 32 ? 2 : 8) {
        int codes[3];
        for (int k = 0; k < 3; k++) {
            codes[k] = start[k] - down;
        }
        best->cost_s = STOP_NEVER_S;
        if (!stop_within(piece, codes)) {
            return 0;
        }
        if (better(setting, piece, codes, after_s, 1, best)) {
            return 1;
        }
    }
    return 0;
}

/* Starting points all over the codes. */
static void scan(const struct stop_setting *setting, struct stop_piece *piece, double after_s,
                 int strict, struct choice *best)
{
    for (int a = 0; a <= STOP_FEWER; a += 6) {
        for (int j1 = 0; j1 <= STOP_FEWER; j1 += 6) {
            for (int j2 = 0; j2 <= STOP_FEWER; j2 += 6) {
                int codes[3] = {piece->most[0] - j1, piece->most[1] - a, piece->most[2] - j2};
                (void)better(setting, piece, codes, after_s, strict, best);
            }
        }
    }
}

/* Cost of the greatest codes, whatever limits they break. */
static double least_time(const struct stop_setting *setting, const struct stop_piece *piece,
                         double after_s)
{
    struct path_brake_numbers numbers;
    struct stop_times times;
    return stop_numbers_of(setting, piece->most, &numbers) &&
                   stop_times_of(setting, piece, &numbers, after_s, &times)
               ? times.cost_s
               : 0.0;
}

static void search_piece(const struct stop_setting *setting, struct stop_piece *piece,
                         const int warm[3], double after_s, struct choice *best)
{
    const struct choice none = {{0, 0, 0},    STOP_NEVER_S, STOP_NEVER_S,
                                STOP_NEVER_S, STOP_NEVER_S, STOP_NEVER_S};
    struct choice rough = none;
    (void)better(setting, piece, piece->most, after_s, 0, &rough);
    int near[3];
    for (int k = 0; k < 3; k++) {
        near[k] = warm[k] < piece->most[k] ? warm[k] : piece->most[k];
    }
    (void)better(setting, piece, near, after_s, 0, &rough);
    if (rough.cost_s < STOP_NEVER_S) {
        climb(setting, piece, after_s, 0, 4, &rough);
    }
    if (rough.cost_s > NEAR * least_time(setting, piece, after_s)) {
        scan(setting, piece, after_s, 0, &rough);
    }
    *best = none;
    if (rough.cost_s < STOP_NEVER_S || lowered(setting, piece, piece->most, after_s, &rough)) {
        climb(setting, piece, after_s, 0, 8, &rough);
        if (stop_strictly(setting, piece, rough.codes)) {
            *best = rough;
            return;
        }
        if (!lowered(setting, piece, rough.codes, after_s, best) &&
            !lowered(setting, piece, piece->most, after_s, best)) {
            *best = none;
        }
    }
    if (best->cost_s >= STOP_NEVER_S) {
        scan(setting, piece, after_s, 1, best);
    }
    if (best->cost_s < STOP_NEVER_S) {
        climb(setting, piece, after_s, 1, 4, best);
    }
}

/* Tries the codes `from`, each less a quarter of its number in `quarters`; a negative number raises a code. Takes them
 * as `best` if they are better and keep the limits strictly. Returns whether it took them. */
static int lower_by(const struct stop_setting *setting, struct stop_piece *piece, const int from[3],
                    const int quarters[3], double after_s, struct choice *best)
{
    int codes[3];
    for (int k = 0; k < 3; k++) {
        codes[k] = from[k] - quarters[k] / 4;
    }
    return better(setting, piece, codes, after_s, 1, best);
}

/* A search of few trials: the codes of the next piece, else lower ones, of all three or of the onset first, down to the
 * lowest; then all raised together as far as the limits allow. */
static void search_quickly(const struct stop_setting *setting, struct stop_piece *piece,
                           const int warm[3], double after_s, struct choice *best)
{
    static const int8_t shapes[][3] = {{4, 4, 4}, {4, 2, 0}, {4, 0, 0}, {2, 4, 4}};
    const struct choice none = {{0, 0, 0},    STOP_NEVER_S, STOP_NEVER_S,
                                STOP_NEVER_S, STOP_NEVER_S, STOP_NEVER_S};
    int near[3];
    for (int k = 0; k < 3; k++) {
        near[k] = warm[k] < piece->most[k] ? warm[k] : piece->most[k];
    }
    *best = none;
    int found = better(setting, piece, near, after_s, 1, best);
    for (int down = 0; down <= STOP_FEWER && !found; down += 4) {
        const size_t count = down > 0 ? sizeof shapes / sizeof shapes[0] : 1u;
        for (size_t i = 0; i < count && !found; i++) {
            const int quarters[3] = {down * shapes[i][0], down * shapes[i][1], down * shapes[i][2]};
            found = lower_by(setting, piece, piece->most, quarters, after_s, best);
        }
    }
    for (int step = found ? 4 : 0; step >= 1; step /= 2) {
        int raised = 1;
        while (raised) {
            const int quarters[3] = {-4 * step, -4 * step, -4 * step};
            const int from[3] = {best->codes[0], best->codes[1], best->codes[2]};
            raised = lower_by(setting, piece, from, quarters, after_s, best);
        }
    }
}

/* A piece without a path stop: the nominal motion continues into the next. */
static void wait_for_next(const struct stop_piece *piece, double after_s, struct choice *out)
{
    double seconds = piece->seconds;
    memset(out, 0, sizeof *out);
    out->first_s = out->worst_s = after_s + seconds;
    out->mean_s = after_s + 0.5 * seconds;
}

/* Codes that are given. */
static void known_choice(const struct stop_setting *setting, const struct stop_piece *piece,
                         const struct stop_found *found, double after_s, struct choice *out)
{
    struct path_brake_numbers numbers;
    struct stop_times times;
    wait_for_next(piece, after_s, out);
    if (found->codes[1] == 0u) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        out->codes[k] = found->codes[k];
    }
    if (!stop_numbers_of(setting, out->codes, &numbers) ||
        !stop_times_of(setting, piece, &numbers, after_s, &times)) {
        return;
    }
    out->mean_s = times.mean_s;
    out->worst_s = times.worst_s;
    out->first_s = times.first_s;
}

/* Takes the given codes. Returns 1 if they are `kept` and keep the limits also in place of the path stop `before`. */
static int kept_choice(const struct stop_setting *setting, struct stop_piece *piece,
                       const struct stop_found *found, double after_s, struct choice *best)
{
    known_choice(setting, piece, found, after_s, best);
    return found->kept != 0u && stop_out_of_brakes_keeps(setting, piece, best->codes);
}

/* The numbers of a piece, or none where waiting for the next is about as good. */
static void choose(const struct stop_setting *setting, struct stop_piece *piece, const int warm[3],
                   double after_s, struct choice *best)
{
    struct choice none;
    if (setting->quick != 0u) {
        search_quickly(setting, piece, warm, after_s, best);
    } else {
        search_piece(setting, piece, warm, after_s, best);
    }
    wait_for_next(piece, after_s, &none);
    if (none.mean_s < WAIT_BETTER * best->mean_s ||
        (none.mean_s < WAIT_AS_GOOD * best->mean_s && best->longest_s > 2.0 * none.worst_s)) {
        *best = none;
    }
}

/* The codes that are given, if they stay, else those of a search. */
static void search_or_keep(const struct stop_setting *setting, struct stop_piece *piece,
                           const struct stop_found *found, const int warm[3], double after_s,
                           struct choice *best)
{
    const int start[3] = {found->start[0], found->start[1], found->start[2]};
    if (!kept_choice(setting, piece, found, after_s, best)) {
        choose(setting, piece, start[1] > 0 ? start : warm, after_s, best);
    }
}

/* If path stops from a piece exceed a limit, those from the previous piece usually do so as well, from its last instant
 * at the same override. These are evaluated first; the result does not depend on the order. */
static void suspect_as_next(struct stop_piece *piece, const struct stop_overridden suspects[2])
{
    piece->suspect = piece->count - 1u;
    piece->close->suspect = piece->close->count - 1u;
    piece->suspect_override = suspects[0];
    piece->suspect_override.instant = piece->count - 1u;
    piece->suspect_before = suspects[1];
    piece->suspect_before.instant = piece->count - 1u;
}

void stop_search(const struct program *p, const struct stop_limits *limits,
                 const struct stop_path *path, struct stop_found *found)
{
    struct stop_setting setting;
    struct stop_last last;
    struct stop_piece piece;
    struct stop_piece close;
    double after_s = 0.0;
    double left_s = 0.0;
    stop_setting_open(&setting, p, limits, path, &last);
    int warm[3] = {setting.most[0], setting.most[1], setting.most[2]};
    struct stop_overridden suspects[2] = {{0, 0, -1}, {0, 0, 0}};
    for (uint32_t i = p->header.piece_count; i > 0; i--) {
        struct choice best;
        stop_piece_fill(&setting, p, i - 1u, left_s, STOP_INSTANT_S, &piece);
        if (found[i - 1u].known != 0u) {
            known_choice(&setting, &piece, &found[i - 1u], after_s, &best);
        } else {
            stop_piece_fill(&setting, p, i - 1u, left_s, STOP_CLOSE_S, &close);
            for (int k = 0; k < 3; k++) {
                piece.before[k] = found[i - 1u].before[k];
            }
            piece.close = &close;
            suspect_as_next(&piece, suspects);
            search_or_keep(&setting, &piece, &found[i - 1u], warm, after_s, &best);
            suspects[0] = piece.suspect_override;
            suspects[1] = piece.suspect_before;
        }
        for (int k = 0; k < 3; k++) {
            found[i - 1u].codes[k] = (uint8_t)best.codes[k];
            warm[k] = best.codes[k] > 0 ? best.codes[k] : warm[k];
        }
        found[i - 1u].worst_s = best.worst_s;
        found[i - 1u].mean_s = best.mean_s;
        after_s = best.first_s;
        left_s += piece.seconds;
    }
}

static void most_of(double *most, double value)
{
    *most = stop_greater(*most, fabs(value));
}

void stop_used(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path, struct stop_limits *used)
{
    struct stop_setting setting;
    struct stop_last last;
    stop_setting_open(&setting, p, limits, path, &last);
    memset(used, 0, sizeof *used);
    for (uint32_t i = 0; i < p->header.piece_count; i++) {
        struct program_piece from;
        double c[8];
        program_piece_get(p, i, &from);
        double seconds = stop_piece_powers(&from, c);
        int parts = (int)fmin(stop_greater(ceil(seconds / STOP_INSTANT_S), 4.0), 256.0);
        for (int k = 0; k <= parts; k++) {
            double u = STOP_END_MARGIN +
                       (1.0 - 2.0 * STOP_END_MARGIN) * k / parts; /* jerks jump at joints */
            struct stop_state at = {stop_piece_value(c, u, 0), stop_piece_value(c, u, 1) / seconds,
                                    stop_piece_value(c, u, 2) / (seconds * seconds)};
            double j = stop_piece_value(c, u, 3) / (seconds * seconds * seconds);
            const struct stop_row *row = &setting.lookup.rows[stop_row_at(&setting.lookup, at.s)];
            struct stop_axes axes;
            stop_axes_of(&setting.lookup, row, stop_share_of(row, at.s), &at, j, &axes);
            most_of(&used->feed, at.v);
            most_of(&used->acceleration, at.a);
            most_of(&used->jerk, j);
            most_of(&used->centripetal, row->curvature * at.v * at.v);
            for (uint32_t axis = 0; axis < setting.lookup.axis_count; axis++) {
                most_of(&used->axis_velocity[axis], axes.velocity[axis]);
                most_of(&used->axis_acceleration[axis], axes.acceleration[axis]);
                most_of(&used->axis_jerk[axis], axes.jerk[axis]);
                most_of(&used->reach[axis], axes.velocity[axis] + limits->time_constant[axis] *
                                                                      axes.acceleration[axis]);
            }
        }
    }
}
