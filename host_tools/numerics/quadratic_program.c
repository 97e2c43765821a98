/* SPDX-License-Identifier: MIT */
/*
 * Implements numerics/quadratic_program.h (see there). Called by host_tools/hodograph/native. Any thread. Writes only
 * the caller's arrays; no I/O.
 *
 * Every bound becomes a side: coefficient x + slack = most, slack >= 0, with a multiplier >= 0. A Newton step needs
 *
 *     hessian dx + sum of coefficient d multiplier = -residual of the gradient      coefficient dx + d slack = -excess
 *     multiplier d slack + slack d multiplier = target - multiplier slack
 *
 * With weight = multiplier / slack of each side, dx follows from one matrix, hessian + sum of weight coefficient
 * coefficient'. The share t of an interval is one more unknown of its soft sides, coefficient x - t + slack = most. It
 * is eliminated first: with the sum W and the mean m of the coefficients by weight, and the weight w of t itself, there
 * remains
 *
 *     sum of weight (coefficient - m) (coefficient - m)' + m m' W w / (W + w)
 *
 * a sum of squares, so that no digits are lost where weights are far apart. Hard sides are those with m = 0.
 */
#include "numerics/quadratic_program.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { WIDTH = 4, BAND = 3, LOWER = 10, MOST_ITERATIONS = 100, MOST_STALLED = 6 };
static const double NEAR = 1e-3;
static const double LEAST_TARGET = 0.01; /* of the gap, in tolerances: below it is rounding */
static const double STEP_SHARE = 0.995;  /* of the distance to the nearest boundary */
static const double LEAST_PIVOT = 1e-15; /* as a share of the diagonal */
static const double FARTHEST = 1e8;      /* unknowns add up to less */
static const double START_PRODUCT = 0.1; /* of slack and multiplier of each side */
static const double START_SLACK = 0.05;  /* in lengths of the coefficients, */
static const double LEAST_SLACK = 1e-3;  /* and at least */

/* An inequality: a x - t + slack = most. */
struct side {
    double a[WIDTH];
    double most;
    double slack, multiplier;
    double excess;          /* a x - t + slack - most */
    double inverse, weight; /* 1 / slack, multiplier / slack */
    double d_slack, d_multiplier;
    double correction; /* (product of the steps - target) / slack; 0 in the predictor */
};

/* An interval: its sides, the soft ones first, and its share t: by how much the soft sides may be exceeded. */
struct link {
    uint32_t first, hard, end;      /* numbers of its sides; `hard`: the first hard one */
    double share, share_multiplier; /* t, and the multiplier of t >= 0 */
    double d_share, d_share_multiplier, correction;
    double sum, own;    /* W, w */
    double mean[WIDTH]; /* m */
    double right;       /* right side of the equation of t */
};

/* The solution so far. Row i of a band holds the entries of row i of a symmetric matrix in columns i - BAND to i. */
struct solving {
    const struct quadratic_program *given;
    uint32_t size;
    bool soft;
    double *x, *best;         /* now, and where the greatest residual was least */
    double *step;             /* the right side, until it is solved for */
    double *gradient;         /* of the objective */
    double *residual;         /* with the multipliers of the sides: 0 at the solution */
    double *hessian, *matrix; /* bands */
    double *pivot;            /* inverses of the matrix' pivots */
    struct side *sides;
    struct link *links;
    double count;  /* of products of slack and multiplier */
    double length; /* share of the last step that is taken */
    double objective;
    double gap;           /* sum of slack multiplier, those of the shares among them */
    double step_products; /* sum of d_slack d_multiplier, those of the shares among them */
    double violated;      /* the greatest excess, slack aside */
    double unbalanced;    /* the greatest entry of the residual, that of shares among them */
    double value;         /* sum of most multiplier */
};

static size_t numbers_of(size_t bytes)
{
    return (bytes + sizeof(double) - 1) / sizeof(double);
}

size_t quadratic_work(uint32_t intervals, uint32_t rows)
{
    const size_t size = 2 * (size_t)intervals + 2;
    const size_t sides = 2 * (size_t)rows + 2 * size;
    return BAND * (BAND + 2) + size * (5 + 2 * (BAND + 1)) +
           numbers_of(sides * sizeof(struct side)) + numbers_of(intervals * sizeof(struct link));
}

static double *taken(double **work, size_t count)
{
    double *own = *work;
    *work += count;
    return own;
}

/* The same, with some zeros before it. */
static double *zeros_taken(double **work, size_t zeros, size_t count)
{
    double *before = taken(work, zeros + count);
    memset(before, 0, zeros * sizeof(double));
    return before + zeros;
}

static double dot(const double *a, const double *b)
{
    return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]);
}

static bool known(const struct quadratic_program *p, uint32_t unknown)
{
    return p->low[unknown] == p->high[unknown];
}

/* Puts a side at the end of those of its interval: known unknowns go to the other side of the inequality. */
static void side_add(struct solving *s, uint32_t interval, const double *a, double sign,
                     double most)
{
    const struct quadratic_program *p = s->given;
    struct side *made = &s->sides[s->links[interval].end++];
    memset(made, 0, sizeof *made);
    made->most = sign * most;
    for (uint32_t k = 0; k < WIDTH; k++) {
        const uint32_t unknown = 2 * interval + k;
        if (known(p, unknown)) {
            made->most -= sign * a[k] * p->low[unknown];
        } else {
            made->a[k] = sign * a[k];
        }
    }
}

static uint32_t interval_of(const struct quadratic_program *p, uint32_t unknown)
{
    const uint32_t knot = unknown / 2;
    return knot < p->intervals ? knot : knot - 1;
}

static uint32_t sides_of(double least, double most)
{
    return (isfinite(least) ? 1U : 0U) + (isfinite(most) ? 1U : 0U);
}

/* Where the sides of each interval begin; none is there yet. */
static void sides_place(struct solving *s)
{
    const struct quadratic_program *p = s->given;
    for (uint32_t k = 0; k < p->rows; k++) {
        assert(p->interval[k] >= 0 && p->interval[k] < (int64_t)p->intervals);
        s->links[p->interval[k]].hard += sides_of(p->least[k], p->most[k]);
    }
    for (uint32_t k = 0; k < s->size; k++) {
        if (!known(p, k)) {
            s->links[interval_of(p, k)].end += sides_of(p->low[k], p->high[k]);
        }
    }
    uint32_t next = 0;
    for (uint32_t i = 0; i < p->intervals; i++) {
        struct link *link = &s->links[i];
        const uint32_t rows = link->hard, bounds = link->end;
        link->first = link->end = next;
        link->hard = next + rows;
        next += rows + bounds;
    }
    s->count = next + (s->soft ? p->intervals : 0.0);
}

static void sides_make(struct solving *s)
{
    const struct quadratic_program *p = s->given;
    sides_place(s);
    for (uint32_t k = 0; k < p->rows; k++) {
        const uint32_t interval = (uint32_t)p->interval[k];
        const double *a = p->coefficient + (size_t)WIDTH * k;
        if (isfinite(p->most[k])) {
            side_add(s, interval, a, 1.0, p->most[k]);
        }
        if (isfinite(p->least[k])) {
            side_add(s, interval, a, -1.0, p->least[k]);
        }
    }
    for (uint32_t k = 0; k < s->size; k++) {
        const uint32_t interval = interval_of(p, k);
        double a[WIDTH] = {0.0};
        a[k - 2 * interval] = 1.0;
        if (!known(p, k) && isfinite(p->high[k])) {
            side_add(s, interval, a, 1.0, p->high[k]);
        }
        if (!known(p, k) && isfinite(p->low[k])) {
            side_add(s, interval, a, -1.0, p->low[k]);
        }
    }
    for (uint32_t i = 0; i < p->intervals && !s->soft; i++) {
        s->links[i].hard = s->links[i].first;
    }
}

/* The hessian as a band, known unknowns included: the gradient needs them. matrix_factor leaves them out. */
static void hessian_make(struct solving *s)
{
    const struct quadratic_program *p = s->given;
    memset(s->hessian, 0, sizeof(double) * (BAND + 1) * s->size);
    for (uint32_t i = 0; i < p->intervals; i++) {
        const double *block = p->hessian + (size_t)WIDTH * WIDTH * i;
        for (uint32_t k = 0; k < WIDTH; k++) {
            for (uint32_t l = 0; l <= k; l++) {
                s->hessian[(size_t)(BAND + 1) * (2 * i + k) + BAND - (k - l)] +=
                    block[WIDTH * k + l];
            }
        }
    }
    for (uint32_t k = 0; k < s->size; k++) {
        s->hessian[(size_t)(BAND + 1) * k + BAND] += p->curvature;
    }
}

/* The objective's gradient, and the objective. */
static void gradient_make(struct solving *s)
{
    const struct quadratic_program *p = s->given;
    double *out = s->gradient;
    memset(out, 0, sizeof(double) * s->size);
    for (uint32_t k = 0; k < s->size; k++) {
        const double *row = s->hessian + (size_t)(BAND + 1) * k;
        out[k] += row[BAND] * s->x[k];
        for (uint32_t lag = 1; lag <= BAND && lag <= k; lag++) {
            out[k] += row[BAND - lag] * s->x[k - lag];
            out[k - lag] += row[BAND - lag] * s->x[k];
        }
    }
    s->objective = 0.0;
    for (uint32_t k = 0; k < s->size; k++) {
        s->objective += (p->gradient[k] + 0.5 * out[k]) * s->x[k];
        out[k] += p->gradient[k];
    }
}

/* Moves an interval's sides by the last step. */
static void link_move(const struct solving *s, struct link *link)
{
    for (uint32_t k = link->first; k < link->end; k++) {
        struct side *one = &s->sides[k];
        one->slack += s->length * one->d_slack;
        one->multiplier += s->length * one->d_multiplier;
    }
    link->share += s->length * link->d_share;
    link->share_multiplier += s->length * link->d_share_multiplier;
}

/* Excesses and weights of an interval's sides, and what they add to the residual. */
static void link_evaluate(struct solving *s, uint32_t interval)
{
    struct link *link = &s->links[interval];
    const double *x = s->x + 2 * (size_t)interval;
    double *residual = s->residual + 2 * (size_t)interval;
    double added[WIDTH] = {0.0};
    for (uint32_t k = link->first; k < link->end; k++) {
        struct side *one = &s->sides[k];
        const double share = k < link->hard ? link->share : 0.0;
        const double beyond = dot(one->a, x) - share - one->most;
        one->excess = beyond + one->slack;
        one->inverse = 1.0 / one->slack;
        one->weight = one->multiplier * one->inverse;
        one->correction = 0.0;
        s->gap += one->slack * one->multiplier;
        s->value += one->most * one->multiplier;
        s->violated = beyond > s->violated ? beyond : s->violated;
        for (uint32_t l = 0; l < WIDTH; l++) {
            added[l] += one->a[l] * one->multiplier;
        }
    }
    for (uint32_t l = 0; l < WIDTH; l++) {
        residual[l] += added[l];
    }
}

/* The greater magnitude; not a number where one is none. */
static double worse(double worst, double value)
{
    return fabs(value) > worst || isnan(value) ? fabs(value) : worst;
}

/* The same of its share. */
static void share_evaluate(struct solving *s, struct link *link)
{
    const struct quadratic_program *p = s->given;
    double rest = p->penalty + p->curvature * link->share - link->share_multiplier;
    for (uint32_t k = link->first; k < link->hard; k++) {
        rest -= s->sides[k].multiplier;
    }
    link->correction = 0.0;
    s->gap += link->share * link->share_multiplier;
    s->objective += (p->penalty + 0.5 * p->curvature * link->share) * link->share;
    s->unbalanced = worse(s->unbalanced, rest);
}

/* Weighted mean of the coefficients of the soft sides. */
static void mean_make(const struct solving *s, struct link *link)
{
    double sum = 0.0, mean[WIDTH] = {0.0};
    for (uint32_t k = link->first; k < link->hard; k++) {
        const struct side *one = &s->sides[k];
        sum += one->weight;
        for (uint32_t l = 0; l < WIDTH; l++) {
            mean[l] += one->weight * one->a[l];
        }
    }
    for (uint32_t l = 0; l < WIDTH; l++) {
        link->mean[l] = sum > 0.0 ? mean[l] / sum : 0.0;
    }
    link->sum = sum;
    link->own = s->soft ? s->given->curvature + link->share_multiplier / link->share : 1.0;
}

/* Adds weight (a - m) (a - m)' of sides to the lower half of a block, row by row. */
static void squares_add(const struct side *sides, uint32_t first, uint32_t end, const double *mean,
                        double *block)
{
    for (uint32_t k = first; k < end; k++) {
        const struct side *one = &sides[k];
        const double a0 = one->a[0] - mean[0], a1 = one->a[1] - mean[1];
        const double a2 = one->a[2] - mean[2], a3 = one->a[3] - mean[3];
        const double w0 = one->weight * a0, w1 = one->weight * a1;
        const double w2 = one->weight * a2, w3 = one->weight * a3;
        block[0] += w0 * a0;
        block[1] += w1 * a0;
        block[2] += w1 * a1;
        block[3] += w2 * a0;
        block[4] += w2 * a1;
        block[5] += w2 * a2;
        block[6] += w3 * a0;
        block[7] += w3 * a1;
        block[8] += w3 * a2;
        block[9] += w3 * a3;
    }
}

/* What an interval adds to the matrix. */
static void link_square(struct solving *s, uint32_t interval)
{
    static const double NO_MEAN[WIDTH] = {0.0};
    struct link *link = &s->links[interval];
    double block[LOWER] = {0.0};
    mean_make(s, link);
    squares_add(s->sides, link->first, link->hard, link->mean, block);
    squares_add(s->sides, link->hard, link->end, NO_MEAN, block);
    const double both = link->sum * link->own / (link->sum + link->own);
    const double *next = block;
    for (uint32_t k = 0; k < WIDTH; k++) {
        double *row = s->matrix + (size_t)(BAND + 1) * (2 * interval + k) + BAND - k;
        for (uint32_t l = 0; l <= k; l++) {
            row[l] += *next++ + both * link->mean[k] * link->mean[l];
        }
    }
}

/* What the soft sides of an interval add to the right side, `sum`. */
static void soft_right(const struct solving *s, struct link *link, double *sum)
{
    const struct quadratic_program *p = s->given;
    double soft = 0.0, multipliers = 0.0;
    for (uint32_t k = link->first; k < link->hard; k++) {
        const struct side *one = &s->sides[k];
        const double own = one->weight * one->excess - one->correction;
        soft += own;
        multipliers += one->multiplier;
        for (uint32_t l = 0; l < WIDTH; l++) {
            sum[l] += (one->a[l] - link->mean[l]) * (own - one->multiplier);
        }
    }
    const double all = link->sum + link->own;
    const double alone = -p->penalty - p->curvature * link->share - link->correction;
    const double both = link->own * (soft - multipliers) - link->sum * (alone + multipliers);
    link->right = alone + soft;
    for (uint32_t l = 0; l < WIDTH; l++) {
        sum[l] += link->mean[l] * both / all;
    }
}

static void link_right(struct solving *s, uint32_t interval)
{
    struct link *link = &s->links[interval];
    double *right = s->step + 2 * (size_t)interval;
    double sum[WIDTH] = {0.0};
    if (s->soft) {
        soft_right(s, link, sum);
    }
    for (uint32_t k = link->hard; k < link->end; k++) {
        const struct side *one = &s->sides[k];
        const double own = one->weight * one->excess - one->multiplier - one->correction;
        for (uint32_t l = 0; l < WIDTH; l++) {
            sum[l] += one->a[l] * own;
        }
    }
    for (uint32_t l = 0; l < WIDTH; l++) {
        right[l] -= sum[l];
    }
}

/* Takes the last step. Makes everything that its end has, and matrix and right side of the next one's predictor. */
static void assemble(struct solving *s)
{
    for (uint32_t k = 0; k < s->size; k++) {
        s->x[k] += s->length * s->step[k];
    }
    gradient_make(s);
    memcpy(s->residual, s->gradient, sizeof(double) * s->size);
    memset(s->step, 0, sizeof(double) * s->size);
    memcpy(s->matrix, s->hessian, sizeof(double) * (BAND + 1) * s->size);
    s->gap = s->value = s->violated = s->unbalanced = 0.0;
    for (uint32_t i = 0; i < s->given->intervals; i++) {
        link_move(s, &s->links[i]);
        link_evaluate(s, i);
        if (s->soft) {
            share_evaluate(s, &s->links[i]);
        }
        link_square(s, i);
        link_right(s, i);
    }
    for (uint32_t k = 0; k < s->size; k++) {
        s->residual[k] = known(s->given, k) ? 0.0 : s->residual[k];
        s->unbalanced = worse(s->unbalanced, s->residual[k]);
    }
}

/* Factors the matrix in place: row i of a unit triangle, and the inverse of its pivot. Before the first row are as many
 * rows of zeros as it reads back. */
static void matrix_factor(struct solving *s)
{
    double *row = s->matrix;
    for (uint32_t i = 0; i < s->size; i++, row += BAND + 1) {
        const double *one = row - (BAND + 1), *two = one - (BAND + 1);
        double *pivot = s->pivot + i;
        const double u3 = row[0];
        const double u2 = row[1] - u3 * two[2];
        const double u1 = row[2] - u3 * one[1] - u2 * one[2];
        row[0] = u3 * pivot[-3];
        row[1] = u2 * pivot[-2];
        row[2] = u1 * pivot[-1];
        const double own = row[3] - u3 * row[0] - u2 * row[1] - u1 * row[2];
        /* This pivot has no valid digit after rounding: the unknown does not change. */
        pivot[0] = own > LEAST_PIVOT * row[3] && !known(s->given, i) ? 1.0 / own : 0.0;
    }
}

/* Solves for `step`. */
static void matrix_solve(struct solving *s)
{
    double *x = s->step;
    for (uint32_t i = 0; i < s->size; i++) {
        const double *row = s->matrix + (size_t)(BAND + 1) * i;
        x[i] -= s->residual[i];
        for (uint32_t lag = 1; lag <= BAND && lag <= i; lag++) {
            x[i] -= row[BAND - lag] * x[i - lag];
        }
    }
    for (uint32_t i = s->size; i-- > 0;) {
        x[i] *= s->pivot[i];
        for (uint32_t lag = 1; lag <= BAND && i + lag < s->size; lag++) {
            x[i] -= s->matrix[(size_t)(BAND + 1) * (i + lag) + BAND - lag] * x[i + lag];
        }
        x[i] = known(s->given, i) ? 0.0 : x[i];
    }
}

/* How far a step may go until a value is 0, given the limit so far; both as shares of the step. */
static double reach(double value, double step, double most)
{
    return value + most * step < 0.0 ? -value / step : most;
}

static double side_step(struct solving *s, struct side *one, double moved, double most)
{
    one->d_slack = -one->excess - moved;
    one->d_multiplier = -one->multiplier - one->correction - one->weight * one->d_slack;
    s->step_products += one->d_slack * one->d_multiplier;
    return reach(one->multiplier, one->d_multiplier, reach(one->slack, one->d_slack, most));
}

/* The steps of an interval's sides and share that follow from the step of the unknowns. Returns how far the step may go
 * as a share of it, at most `most`. */
static double link_step(struct solving *s, uint32_t interval, double most)
{
    struct link *link = &s->links[interval];
    const double *dx = s->step + 2 * (size_t)interval;
    if (s->soft) {
        const double all = link->sum + link->own, mean = dot(link->mean, dx);
        const double base = (link->own * mean - link->right) / all;
        link->d_share = (link->right + link->sum * mean) / all;
        link->d_share_multiplier = -link->share_multiplier - link->correction -
                                   link->share_multiplier / link->share * link->d_share;
        s->step_products += link->d_share * link->d_share_multiplier;
        most = reach(link->share, link->d_share, most);
        most = reach(link->share_multiplier, link->d_share_multiplier, most);
        for (uint32_t k = link->first; k < link->hard; k++) {
            struct side *one = &s->sides[k];
            double moved = base;
            for (uint32_t l = 0; l < WIDTH; l++) {
                moved += (one->a[l] - link->mean[l]) * dx[l];
            }
            most = side_step(s, one, moved, most);
        }
    }
    for (uint32_t k = link->hard; k < link->end; k++) {
        most = side_step(s, &s->sides[k], dot(s->sides[k].a, dx), most);
    }
    return most;
}

/* Solves for a step. Returns the share of it to take: at most 1, and STEP_SHARE of the distance to the nearest
 * boundary. */
static double direction(struct solving *s)
{
    double most = 1.0 / STEP_SHARE;
    matrix_solve(s);
    s->step_products = 0.0;
    for (uint32_t i = 0; i < s->given->intervals; i++) {
        most = link_step(s, i, most);
    }
    return STEP_SHARE * most;
}

/* The right side of the corrector: the products of the predictor's steps, and the target of each product. */
static void correct(struct solving *s, double target)
{
    memset(s->step, 0, sizeof(double) * s->size);
    for (uint32_t i = 0; i < s->given->intervals; i++) {
        struct link *link = &s->links[i];
        for (uint32_t k = link->first; k < link->end; k++) {
            struct side *one = &s->sides[k];
            one->correction = (one->d_slack * one->d_multiplier - target) * one->inverse;
        }
        if (s->soft) {
            link->correction = (link->d_share * link->d_share_multiplier - target) / link->share;
        }
        link_right(s, i);
    }
}

/* Starts a hard side: the slack that the unknowns leave, or the least one, and the multiplier that makes
 * START_PRODUCT. */
static void hard_start(struct side *one, double left)
{
    const double least = fmax(LEAST_SLACK, START_SLACK * sqrt(dot(one->a, one->a)));
    one->slack = fmax(least, left);
    one->multiplier = START_PRODUCT / one->slack;
}

/* Starts a share so that every soft side has slack. The multipliers of the sides add up to half the penalty, and the
 * multiplier of the share is the other half. */
static void soft_start(const struct solving *s, struct link *link, const double *x)
{
    double over = 0.0, sum = 0.0;
    for (uint32_t k = link->first; k < link->hard; k++) {
        struct side *one = &s->sides[k];
        one->slack = one->most - dot(one->a, x);
        over = fmax(over, -one->slack);
    }
    link->share = 1.0 + 2.0 * over;
    link->share_multiplier = 0.5 * s->given->penalty;
    for (uint32_t k = link->first; k < link->hard; k++) {
        s->sides[k].slack += link->share;
        sum += 1.0 / s->sides[k].slack;
    }
    for (uint32_t k = link->first; k < link->hard; k++) {
        s->sides[k].multiplier = 0.5 * s->given->penalty / (s->sides[k].slack * sum);
    }
}

/* Begins at the unknowns that were given. */
static void start(struct solving *s)
{
    const struct quadratic_program *p = s->given;
    for (uint32_t k = 0; k < s->size; k++) {
        s->x[k] = known(p, k) ? p->low[k] : s->best[k];
    }
    for (uint32_t i = 0; i < p->intervals; i++) {
        struct link *link = &s->links[i];
        const double *x = s->x + 2 * (size_t)i;
        if (s->soft) {
            soft_start(s, link, x);
        } else {
            link->share = link->share_multiplier = 1.0;
        }
        for (uint32_t k = link->hard; k < link->end; k++) {
            hard_start(&s->sides[k], s->sides[k].most - dot(s->sides[k].a, x));
        }
    }
    s->length = 0.0;
}

/* Whether the multipliers prove that there is no solution (lemma of Farkas): the sum of all sides, each times its
 * multiplier, is a x <= value with a of at most `rest`. With value < -FARTHEST rest no x with entries that add up to
 * less than FARTHEST satisfies it. */
static bool impossible(const struct solving *s)
{
    double rest = 0.0;
    for (uint32_t k = 0; k < s->size; k++) {
        const double own = known(s->given, k) ? 0.0 : s->residual[k] - s->gradient[k];
        rest = fmax(rest, fabs(own));
    }
    return !s->soft && s->violated >= s->given->tolerance && s->value < -FARTHEST * rest;
}

/* The greatest residual; not a number where one is none. */
static double worst_of(const struct quadratic_report *report)
{
    const double worst = report->violated > report->gradient ? report->violated : report->gradient;
    return report->gap > worst || isnan(report->gap) ? report->gap : worst;
}

/* Keeps the place where the greatest residual is least. Returns whether that is here. */
static bool best_keep(const struct solving *s, struct quadratic_report *report)
{
    struct quadratic_report here = {report->iterations, s->violated, s->unbalanced, 0.0};
    here.gap = s->gap / fmax(1.0, fabs(s->objective));
    const bool better = worst_of(&here) < worst_of(report);
    if (better) {
        *report = here;
        memcpy(s->best, s->x, sizeof(double) * s->size);
    }
    return better;
}

static struct solving solving_begin(const struct quadratic_program *p, double *unknown,
                                    double *work)
{
    struct solving s = {0};
    s.given = p;
    s.size = 2 * p->intervals + 2;
    s.soft = p->penalty > 0.0;
    s.best = unknown;
    s.x = taken(&work, s.size);
    s.step = taken(&work, s.size);
    s.gradient = taken(&work, s.size);
    s.residual = taken(&work, s.size);
    s.pivot = zeros_taken(&work, BAND, s.size);
    s.hessian = taken(&work, (size_t)(BAND + 1) * s.size);
    s.matrix = zeros_taken(&work, BAND * (BAND + 1), (size_t)(BAND + 1) * s.size);
    s.links = (struct link *)(void *)taken(&work, numbers_of(p->intervals * sizeof(struct link)));
    s.sides = (struct side *)(void *)work;
    memset(s.step, 0, sizeof(double) * s.size);
    memset(s.links, 0, p->intervals * sizeof(struct link));
    sides_make(&s);
    hessian_make(&s);
    start(&s);
    return s;
}

/* Mehrotra's step. The predictor has the target 0. How far it may go gives the target of the corrector. */
static void step_make(struct solving *s)
{
    matrix_factor(s);
    const double length = direction(s);
    const double left = fmax(0.0, 1.0 - length + length * length * s->step_products / s->gap);
    const double least = LEAST_TARGET * s->given->tolerance * fmax(1.0, fabs(s->objective));
    correct(s, fmax(left * left * left * s->gap, least) / s->count);
    s->length = direction(s);
}

int quadratic_solve(const struct quadratic_program *program, double *unknown, double *work,
                    struct quadratic_report *report)
{
    struct solving s = solving_begin(program, unknown, work);
    *report = (struct quadratic_report){0, HUGE_VAL, HUGE_VAL, HUGE_VAL};
    uint32_t stalled = 0;
    for (report->iterations = 0;; report->iterations++) {
        assemble(&s);
        stalled = best_keep(&s, report) ? 0 : stalled + 1;
        if (worst_of(report) < program->tolerance) {
            return QUADRATIC_SOLVED;
        }
        if (impossible(&s)) {
            return QUADRATIC_INFEASIBLE;
        }
        if (report->iterations == MOST_ITERATIONS ||
            (stalled > MOST_STALLED && worst_of(report) < NEAR)) {
            break;
        }
        step_make(&s);
    }
    return worst_of(report) < NEAR ? QUADRATIC_NEAR : QUADRATIC_STUCK;
}
