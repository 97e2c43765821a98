/* SPDX-License-Identifier: MIT */
/* Implements offline/smoothing.h (see there): Newton's method with a barrier for banded least squares in bounds. Called
 * by host_tools/hodograph/native. Any thread. Writes only the lent arrays; no I/O. */
#include "offline/smoothing.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The objective has differences up to this order; greatest number of Newton steps for one barrier, and of trials in
 * the line search of a step. */
enum { SMOOTHING_ORDER = 3, SMOOTHING_STEPS = 60, SMOOTHING_TRIALS = 40 };
static const double SMOOTHING_CLOSE = 1e-3;  /* a step that gains less, in barriers, is the last */
static const double SMOOTHING_FIRST = 1e-3;  /* barrier of the first minimum */
static const double SMOOTHING_SHRINK = 0.1;  /* of the barrier, from one minimum to the next */
static const double SMOOTHING_INSIDE = 0.95; /* of the distance to the nearest bound */
static const double SMOOTHING_GAIN = 0.1;    /* of the gain that the gradient promises */

/* Shifts, and what follows from them. */
struct smoothing_state {
    double *shift;      /* [count][directions] */
    double *room;       /* [count]: square of the bound less that of the shift */
    double *difference; /* [count - 3][3] */
    double value;       /* sum of squares and barrier; inf outside the bounds */
};

/* The search. Row i of a band holds the entries of row i of a symmetric matrix in columns i - width to i. */
struct smoothing_search {
    const struct smoothing *given;
    uint32_t rows, size, width;
    double *point;   /* [count][3], moved */
    double *hessian; /* band of the sum of squares */
    double *band;
    double *gradient, *step; /* [size] */
    struct smoothing_state at, tried;
};

size_t smoothing_work(uint32_t count, uint32_t directions)
{
    const size_t n = count;
    const size_t width = (size_t)SMOOTHING_ORDER * directions + directions;
    const size_t state = n * directions + n + 3 * n;
    return 3 * n + 2 * n * directions * width + 2 * n * directions + 2 * state;
}

static double *smoothing_taken(double **work, size_t count)
{
    double *own = *work;
    *work += count;
    return own;
}

static struct smoothing_state smoothing_state(const struct smoothing *s, double **work)
{
    struct smoothing_state made = {0};
    made.shift = smoothing_taken(work, (size_t)s->count * s->directions);
    made.room = smoothing_taken(work, s->count);
    made.difference = smoothing_taken(work, (size_t)3 * s->count);
    return made;
}

/* 1 where a point does not move: it then has no part in the barrier. */
static double smoothing_square(const struct smoothing *s, uint32_t k)
{
    return s->bound[k] > 0.0 ? s->bound[k] * s->bound[k] : 1.0;
}

/* Entry of the product of the directions a of point k and b of point l. */
static double smoothing_cosine(const struct smoothing *s, uint32_t k, uint32_t a, uint32_t l,
                               uint32_t b)
{
    const double *first = s->normal + (size_t)3 * s->directions * k;
    const double *second = s->normal + (size_t)3 * s->directions * l;
    double sum = 0.0;
    for (uint32_t axis = 0; axis < 3; axis++) {
        sum += first[axis * s->directions + a] * second[axis * s->directions + b];
    }
    return sum;
}

/* Adds the coupling of the points k and k + lag. */
static void smoothing_couple(struct smoothing_search *m, uint32_t k, uint32_t lag, double both)
{
    const struct smoothing *s = m->given;
    const uint32_t l = k + lag;
    if (both == 0.0 || !(s->bound[k] > 0.0) || !(s->bound[l] > 0.0)) {
        return;
    }
    for (uint32_t b = 0; b < s->directions; b++) {
        const uint32_t row = l * s->directions + b;
        for (uint32_t a = 0; a < s->directions; a++) {
            const uint32_t column = k * s->directions + a;
            if (column <= row) {
                double *entry =
                    m->hessian + (size_t)(m->width + 1) * row + m->width - (row - column);
                *entry += smoothing_cosine(s, k, a, l, b) * both;
            }
        }
    }
}

static void smoothing_hessian(struct smoothing_search *m)
{
    const struct smoothing *s = m->given;
    memset(m->hessian, 0, sizeof(double) * (m->width + 1) * m->size);
    for (uint32_t k = 0; k < s->count; k++) {
        for (uint32_t lag = 0; lag <= SMOOTHING_ORDER && k + lag < s->count; lag++) {
            double both = 0.0;
            for (uint32_t i = 0; i + lag <= SMOOTHING_ORDER; i++) {
                if (k >= i && k - i < m->rows) {
                    const double *c = s->coefficient + (size_t)4 * (k - i);
                    both += c[i] * c[i + lag];
                }
            }
            smoothing_couple(m, k, lag, both);
        }
        for (uint32_t a = 0; a < s->directions && !(s->bound[k] > 0.0); a++) {
            m->hessian[(size_t)(m->width + 1) * (k * s->directions + a) + m->width] = 1.0;
        }
    }
}

static void smoothing_move(struct smoothing_search *m, const double *shift)
{
    const struct smoothing *s = m->given;
    for (uint32_t i = 0; i < 3 * s->count; i++) {
        const double *normal = s->normal + (size_t)s->directions * i;
        const double *own = shift + (size_t)s->directions * (i / 3);
        m->point[i] =
            s->point[i] + normal[0] * own[0] + (s->directions > 1 ? normal[1] * own[1] : 0.0);
    }
}

/* Computes `room`, differences and value of the shifts of a state. */
static void smoothing_evaluate(struct smoothing_search *m, struct smoothing_state *at, double level)
{
    const struct smoothing *s = m->given;
    double cost = 0.0, barrier = 0.0;
    bool inside = true;
    smoothing_move(m, at->shift);
    for (uint32_t i = 0; i < 3 * m->rows; i++) {
        const double *c = s->coefficient + (size_t)4 * (i / 3);
        const double *p = m->point + i;
        at->difference[i] = c[0] * p[0] + c[1] * p[3] + c[2] * p[6] + c[3] * p[9];
        cost += at->difference[i] * at->difference[i];
    }
    for (uint32_t k = 0; k < s->count; k++) {
        const double square = smoothing_square(s, k);
        at->room[k] = square;
        for (uint32_t a = 0; a < s->directions; a++) {
            at->room[k] -= at->shift[k * s->directions + a] * at->shift[k * s->directions + a];
        }
        inside = inside && at->room[k] > 0.0;
        barrier -= inside && s->bound[k] > 0.0 ? log(at->room[k] / square) : 0.0;
    }
    at->value = inside ? 0.5 * cost + level * barrier : (double)INFINITY;
}

static void smoothing_gradient(struct smoothing_search *m, double level)
{
    const struct smoothing *s = m->given;
    double *slope = m->point; /* the memory of the points, which are not used from here on */
    memset(slope, 0, sizeof(double) * 3 * s->count);
    for (uint32_t i = 0; i < 3 * m->rows; i++) {
        for (uint32_t k = 0; k <= SMOOTHING_ORDER; k++) {
            slope[i + 3 * k] += s->coefficient[(size_t)4 * (i / 3) + k] * m->at.difference[i];
        }
    }
    for (uint32_t i = 0; i < m->size; i++) {
        const uint32_t k = i / s->directions, a = i % s->directions;
        double sum = 2.0 * level * m->at.shift[i] / m->at.room[k];
        for (uint32_t axis = 0; axis < 3; axis++) {
            sum += s->normal[(size_t)s->directions * (3 * k + axis) + a] * slope[3 * k + axis];
        }
        m->gradient[i] = s->bound[k] > 0.0 ? sum : 0.0;
    }
}

/* The Hessian of squares and barrier. */
static void smoothing_curvature(struct smoothing_search *m, double level)
{
    const struct smoothing *s = m->given;
    memcpy(m->band, m->hessian, sizeof(double) * (m->width + 1) * m->size);
    for (uint32_t i = 0; i < m->size; i++) {
        const uint32_t first = i - i % s->directions;
        const double room = m->at.room[i / s->directions];
        double *row = m->band + (size_t)(m->width + 1) * i + m->width - i;
        for (uint32_t j = first; j <= i; j++) {
            row[j] += 4.0 * level * m->at.shift[i] * m->at.shift[j] / (room * room);
        }
        row[i] += 2.0 * level / room;
    }
}

/* Cholesky's factor in place of the band. False: the matrix is not positive to working precision. */
static bool smoothing_factor(struct smoothing_search *m)
{
    const uint32_t w = m->width;
    for (uint32_t i = 0; i < m->size; i++) {
        double *row = m->band + (size_t)(w + 1) * i + w - i;
        const uint32_t first = i > w ? i - w : 0;
        for (uint32_t j = first; j <= i; j++) {
            const double *other = m->band + (size_t)(w + 1) * j + w - j;
            double sum = row[j];
            for (uint32_t k = first; k < j; k++) {
                sum -= row[k] * other[k];
            }
            if (j == i && !(sum > 0.0)) {
                return false;
            }
            row[j] = j < i ? sum / other[j] : sqrt(sum);
        }
    }
    return true;
}

/* Both halves of the solution, in place. */
static void smoothing_substitute(const struct smoothing_search *m, double *x)
{
    const uint32_t w = m->width;
    for (uint32_t i = 0; i < m->size; i++) {
        const double *row = m->band + (size_t)(w + 1) * i + w - i;
        for (uint32_t k = i > w ? i - w : 0; k < i; k++) {
            x[i] -= row[k] * x[k];
        }
        x[i] /= row[i];
    }
    for (uint32_t i = m->size; i-- > 0;) {
        const double *row = m->band + (size_t)(w + 1) * i + w - i;
        x[i] /= row[i];
        for (uint32_t k = i > w ? i - w : 0; k < i; k++) {
            x[k] -= row[k] * x[i];
        }
    }
}

/* Newton's step; returns by how much it lowers the value at most. */
static double smoothing_step(struct smoothing_search *m, double level)
{
    double decrease = 0.0;
    smoothing_gradient(m, level);
    smoothing_curvature(m, level);
    const bool sound = smoothing_factor(m);
    for (uint32_t i = 0; i < m->size; i++) {
        const double flat = 2.0 * level / m->at.room[i / m->given->directions];
        m->step[i] = sound ? -m->gradient[i] : -m->gradient[i] / flat;
    }
    if (sound) {
        smoothing_substitute(m, m->step);
    }
    for (uint32_t i = 0; i < m->size; i++) {
        decrease -= m->gradient[i] * m->step[i];
    }
    return decrease;
}

/* The greatest multiple of the step that stays inside the bounds. */
static double smoothing_longest(const struct smoothing_search *m)
{
    const struct smoothing *s = m->given;
    double least = (double)INFINITY;
    for (uint32_t k = 0; k < s->count; k++) {
        double a = 0.0, b = 0.0;
        for (uint32_t direction = 0; direction < s->directions; direction++) {
            const uint32_t i = k * s->directions + direction;
            a += m->step[i] * m->step[i];
            b += m->at.shift[i] * m->step[i];
        }
        if (s->bound[k] > 0.0 && a > 0.0) {
            least = fmin(least, (sqrt(b * b + a * m->at.room[k]) - b) / a);
        }
    }
    return least;
}

/* Searches along the step for a value that is low enough. False: there is none. */
static bool smoothing_search_line(struct smoothing_search *m, double level, double decrease)
{
    double along = fmin(1.0, SMOOTHING_INSIDE * smoothing_longest(m));
    for (uint32_t trial = 0; trial < SMOOTHING_TRIALS; trial++) {
        for (uint32_t i = 0; i < m->size; i++) {
            m->tried.shift[i] = m->at.shift[i] + along * m->step[i];
        }
        smoothing_evaluate(m, &m->tried, level);
        if (m->tried.value <= m->at.value - SMOOTHING_GAIN * along * decrease) {
            const struct smoothing_state before = m->at;
            m->at = m->tried;
            m->tried = before;
            return true;
        }
        along *= 0.5;
    }
    return false;
}

static void smoothing_minimum(struct smoothing_search *m, double level)
{
    smoothing_evaluate(m, &m->at, level);
    for (uint32_t step = 0; step < SMOOTHING_STEPS; step++) {
        const double decrease = smoothing_step(m, level);
        if (!(decrease > SMOOTHING_CLOSE * level) || !smoothing_search_line(m, level, decrease)) {
            return;
        }
    }
}

void smoothing_solve(const struct smoothing *s, double barrier, double *shift, double *work)
{
    struct smoothing_search m = {.given = s};
    m.rows = s->count > SMOOTHING_ORDER ? s->count - SMOOTHING_ORDER : 0;
    m.size = s->count * s->directions;
    m.width = SMOOTHING_ORDER * s->directions + s->directions - 1;
    m.point = smoothing_taken(&work, (size_t)3 * s->count);
    m.hessian = smoothing_taken(&work, (size_t)(m.width + 1) * m.size);
    m.band = smoothing_taken(&work, (size_t)(m.width + 1) * m.size);
    m.gradient = smoothing_taken(&work, m.size);
    m.step = smoothing_taken(&work, m.size);
    m.at = smoothing_state(s, &work);
    m.tried = smoothing_state(s, &work);
    memcpy(m.at.shift, shift, sizeof(double) * m.size);
    smoothing_hessian(&m);
    double level = fmax(barrier, SMOOTHING_FIRST);
    smoothing_minimum(&m, level);
    while (level > barrier) {
        level = fmax(barrier, SMOOTHING_SHRINK * level);
        smoothing_minimum(&m, level);
    }
    memcpy(shift, m.at.shift, sizeof(double) * m.size);
}
