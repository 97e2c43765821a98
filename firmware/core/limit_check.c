/* SPDX-License-Identifier: MIT */
#include "core/limit_check.h"

#include <stddef.h>

#include "core/ph_segment.h"
#include "core/real.h"

#define WAY_DEGREE    7
#define PATH_DEGREE   4 /* of sigma and of the derivatives of all axes */
#define ORDERS        5 /* of time, in majorants: jerk'' is the fifth derivative of the point */
#define MOST_PARTS    32u
#define MOST_HALVINGS 20 /* of a cell */
#define NEWTON_STEPS  4
#define CUT_STEPS     30
#define ROUNDING_BITS 14 /* of each limit, 2^-14 is left for the rounding of numbers here */

enum quantity { VELOCITY, ACCELERATION, JERK, QUANTITIES };

static const struct real zero = {0, 0};

/* One feed piece: F in mm from its start, in powers of u = time / duration. */
struct way {
    struct real c[WAY_DEGREE + 1];
    struct real per_s; /* 1 / duration */
    struct program_override override;
    int64_t start_q40_mm;
    struct real end_mm;
};

/* One segment: polynomials in xi. */
struct path {
    int64_t start_q40_mm;
    struct real length_mm;
    uint32_t axis_count;
    struct real w[PROGRAM_PLANE][3]; /* of a planar program */
    struct real sigma[PATH_DEGREE + 1];
    struct real arc[PATH_DEGREE + 1];                     /* (arc length from the start) / xi */
    struct real direction[PROGRAM_AXES][PATH_DEGREE + 1]; /* derivatives of the axes */
    struct real least_sigma;
};

/* Velocity, acceleration and jerk of each axis at an instant, at rate 1. */
struct motion {
    struct real of[PROGRAM_AXES][QUANTITIES];
};

/* A stretch of a piece on a segment, u from middle - half to middle + half. */
struct cell {
    const struct way *way;
    const struct path *path;
    struct real
        c[WAY_DEGREE + 1]; /* F from the piece's start in powers of x = (u - middle) / half */
    struct real per_s;     /* d x / d t */
    struct real offset_mm; /* start of the piece from the start of the segment */
};

struct check {
    const struct program *program;
    uint32_t axis_count;
    struct real limit[PROGRAM_AXES][QUANTITIES]; /* m = 0: none */
    struct real per_period;                      /* 1/s */
    struct motion last; /* at the end of the stretch before; at rest before the first, */
    int unknown;        /* or not known: before a program that begins in motion */
};

static void set_at_rest(struct motion *out)
{
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            out->of[axis][k] = zero;
        }
    }
}

static struct real horner(const struct real *c, int degree, struct real x)
{
    struct real value = c[degree];
    for (int k = degree - 1; k >= 0; k--) {
        value = real_add(real_mul(value, x), c[k]);
    }
    return value;
}

/* c(x) becomes c(x + by). */
static void shift(struct real *c, int degree, struct real by)
{
    for (int k = 0; k < degree; k++) {
        for (int i = degree - 1; i >= k; i--) {
            c[i] = real_add(c[i], real_mul(c[i + 1], by));
        }
    }
}

/* c(x) becomes c(by x). */
static void stretch(struct real *c, int degree, struct real by)
{
    struct real power = by;
    for (int k = 1; k <= degree; k++) {
        c[k] = real_mul(c[k], power);
        power = real_mul(power, by);
    }
}

static struct real milli(uint32_t value)
{
    const struct real thousand = real_make(1000, 0);
    return real_div(real_make((int64_t)value, 0), thousand);
}

/* --- What is read from the image --- */

static void read_way(struct way *way, const struct program *p, uint32_t i)
{
    struct program_piece piece;
    program_piece_get(p, i, &piece);
    const int e = program_piece_exponent(piece.duration_q32_s);
    const struct real duration_s = real_make((int64_t)piece.duration_q32_s, -32);
    way->c[0] = zero;
    for (int k = 1; k <= WAY_DEGREE; k++) {
        way->c[k] = real_make(piece.c_q40_mm[k - 1], -40);
    }
    stretch(way->c, WAY_DEGREE, real_scale(duration_s, -e));
    way->per_s = real_div(real_make(1, 0), duration_s);
    way->override = piece.override;
    way->start_q40_mm = piece.start_q40_mm;
    way->end_mm = horner(way->c, WAY_DEGREE, real_make(1, 0));
}

/* From Bernstein coefficients of degree 2 to powers. */
static void to_powers(struct real out[3], const int64_t w_q44[3])
{
    out[0] = real_make(w_q44[0], -44);
    out[1] = real_make(2 * (w_q44[1] - w_q44[0]), -44);
    out[2] = real_make(w_q44[0] - 2 * w_q44[1] + w_q44[2], -44);
}

/* out += sign a b, polynomials of degree 2. */
static void add_product(struct real out[PATH_DEGREE + 1], const struct real a[3],
                        const struct real b[3], int32_t sign)
{
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            out[i + k] = real_add(out[i + k], real_times(real_mul(a[i], b[k]), sign));
        }
    }
}

/* Planar: w^2. */
static void read_plane(struct path *path, const struct program_segment *segment)
{
    const struct real *u = path->w[0];
    const struct real *v = path->w[1];
    to_powers(path->w[0], segment->a_q44[PROGRAM_U]);
    to_powers(path->w[1], segment->a_q44[PROGRAM_Q]);
    add_product(path->sigma, u, u, 1);
    add_product(path->sigma, v, v, 1);
    add_product(path->direction[0], u, u, 1);
    add_product(path->direction[0], v, v, -1);
    add_product(path->direction[1], u, v, 2);
}

/* The derivative of an extra axis, from Bernstein coefficients to powers; exact before it is rounded to a real. */
static void read_extra(struct real out[PATH_DEGREE + 1], const struct program_extra *extra)
{
    int64_t d[PATH_DEGREE + 1];
    d[0] = 5 * extra->b_q40[0];
    for (int k = 1; k <= PATH_DEGREE; k++) {
        d[k] = 5 * (extra->b_q40[k] - extra->b_q40[k - 1]);
    }
    out[0] = real_make(d[0], -40);
    out[1] = real_make(4 * (d[1] - d[0]), -40);
    out[2] = real_make(6 * (d[2] - 2 * d[1] + d[0]), -40);
    out[3] = real_make(4 * (d[3] - 3 * (d[2] - d[1]) - d[0]), -40);
    out[4] = real_make(d[4] - 4 * (d[3] + d[1]) + 6 * d[2] + d[0], -40);
}

/* Spatial: A i A*. */
static void read_space(struct path *path, const struct program_segment *segment)
{
    struct real a[PROGRAM_COMPONENTS][3];
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
        const struct real *own = a[component];
        to_powers(a[component], segment->a_q44[component]);
        add_product(path->sigma, own, own, 1);
        add_product(path->direction[0], own, own, component < (uint32_t)PROGRAM_P ? 1 : -1);
    }
    add_product(path->direction[1], a[PROGRAM_U], a[PROGRAM_Q], 2);
    add_product(path->direction[1], a[PROGRAM_V], a[PROGRAM_P], 2);
    add_product(path->direction[2], a[PROGRAM_V], a[PROGRAM_Q], 2);
    add_product(path->direction[2], a[PROGRAM_U], a[PROGRAM_P], -2);
    for (uint32_t i = 0; i < program_extra_axes(segment->axis_count); i++) {
        read_extra(path->direction[PROGRAM_SPACE + i], &segment->extra[i]);
    }
}

/* Length and the least Bernstein coefficient of sigma; the middle one comes times 3. It is half of the greatest at least. */
static void read_speed(struct path *path, const struct program_segment *segment)
{
    int64_t e_q50[5][PH_AXES];
    ph_segment_hodograph(segment, e_q50);
    path->length_mm = zero;
    path->least_sigma = real_make(e_q50[0][PH_S], -50);
    for (int k = 0; k < 5; k++) {
        struct real one = real_make(e_q50[k][PH_S], -50);
        one = k == 2 ? real_div(one, real_make(3, 0)) : one;
        path->length_mm = real_add(path->length_mm, real_div(one, real_make(5, 0)));
        path->least_sigma = real_less(one, path->least_sigma) != 0 ? one : path->least_sigma;
    }
    path->least_sigma = real_mul(path->least_sigma, real_make(1023, -10));
}

static void read_path(struct path *path, const struct program *p, uint32_t i)
{
    struct program_segment segment;
    program_segment_get(p, i, &segment);
    path->start_q40_mm = segment.start_q40_mm;
    path->axis_count = segment.axis_count;
    for (int k = 0; k <= PATH_DEGREE; k++) {
        path->sigma[k] = zero;
        for (uint32_t axis = 0; axis < path->axis_count; axis++) {
            path->direction[axis][k] = zero;
        }
    }
    if (path->axis_count == PROGRAM_PLANE) {
        read_plane(path, &segment);
    } else {
        read_space(path, &segment);
    }
    for (int k = 0; k <= PATH_DEGREE; k++) {
        path->arc[k] = real_div(path->sigma[k], real_make(k + 1, 0));
    }
    read_speed(path, &segment);
}

/* --- The motion at an instant --- */

/* xi at an arc length of the segment; the curve is continued beyond its ends. */
static struct real parameter(const struct path *path, struct real s_mm)
{
    struct real xi = real_div(s_mm, path->length_mm);
    for (int step = 0; step < NEWTON_STEPS; step++) {
        const struct real s = real_mul(horner(path->arc, PATH_DEGREE, xi), xi);
        xi = real_sub(xi, real_div(real_sub(s, s_mm), horner(path->sigma, PATH_DEGREE, xi)));
    }
    return xi;
}

/* Derivatives 1 to 3 of F in time. */
static void feed_at(const struct cell *cell, struct real x, struct real f[QUANTITIES])
{
    struct real per_s = cell->per_s;
    struct real c[WAY_DEGREE + 1];
    for (int k = 0; k <= WAY_DEGREE; k++) {
        c[k] = cell->c[k];
    }
    for (int order = 0; order < QUANTITIES; order++) {
        const int degree = WAY_DEGREE - 1 - order;
        for (int k = 0; k <= degree; k++) {
            c[k] = real_times(c[k + 1], k + 1);
        }
        f[order] = real_mul(horner(c, degree, x), per_s);
        per_s = real_mul(per_s, cell->per_s);
    }
}

/* With tangent T = w^2 / sigma and curvature kappa: velocity F' T, acceleration (F'' + i kappa F'^2) T, jerk
 * (F''' - kappa^2 F'^3 + i (3 kappa F' F'' + kappa_s F'^3)) T. docs/theory/numerics.md 16. */
static void motion_in_plane(const struct path *path, struct real xi,
                            const struct real f[QUANTITIES], struct motion *out)
{
    struct real w[PROGRAM_PLANE];
    struct real w1[PROGRAM_PLANE];
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        w[axis] = horner(path->w[axis], 2, xi);
        w1[axis] = real_add(path->w[axis][1], real_times(real_mul(path->w[axis][2], xi), 2));
    }
    const struct real sigma = horner(path->sigma, PATH_DEGREE, xi);
    const struct real per_sigma = real_div(real_make(1, 0), sigma);
    /* conj(w) w' and the imaginary part of conj(w) w'' */
    const struct real re = real_add(real_mul(w[0], w1[0]), real_mul(w[1], w1[1]));
    const struct real im = real_sub(real_mul(w[0], w1[1]), real_mul(w[1], w1[0]));
    const struct real bend =
        real_times(real_sub(real_mul(w[0], path->w[1][2]), real_mul(w[1], path->w[0][2])), 2);
    const struct real per_sigma2 = real_mul(per_sigma, per_sigma);
    const struct real kappa = real_times(real_mul(im, per_sigma2), 2);
    struct real slope =
        real_sub(real_times(bend, 2), real_times(real_mul(real_mul(im, re), per_sigma), 8));
    slope = real_mul(slope, real_mul(per_sigma2, per_sigma));
    const struct real f2 = real_mul(f[0], f[0]);
    const struct real normal = real_mul(kappa, f2);
    const struct real along = real_sub(f[2], real_mul(real_mul(kappa, normal), f[0]));
    const struct real across = real_add(real_times(real_mul(real_mul(kappa, f[0]), f[1]), 3),
                                        real_mul(real_mul(slope, f2), f[0]));
    const struct real tx = real_mul(horner(path->direction[0], PATH_DEGREE, xi), per_sigma);
    const struct real ty = real_mul(horner(path->direction[1], PATH_DEGREE, xi), per_sigma);
    out->of[0][VELOCITY] = real_mul(f[0], tx);
    out->of[1][VELOCITY] = real_mul(f[0], ty);
    out->of[0][ACCELERATION] = real_sub(real_mul(f[1], tx), real_mul(normal, ty));
    out->of[1][ACCELERATION] = real_add(real_mul(f[1], ty), real_mul(normal, tx));
    out->of[0][JERK] = real_sub(real_mul(along, tx), real_mul(across, ty));
    out->of[1][JERK] = real_add(real_mul(along, ty), real_mul(across, tx));
}

/* A polynomial of PATH_DEGREE and its first two derivatives. */
static void taylor(const struct real c[PATH_DEGREE + 1], struct real x, struct real out[3])
{
    struct real value = c[PATH_DEGREE];
    struct real first = zero;
    struct real half_second = zero;
    for (int k = PATH_DEGREE - 1; k >= 0; k--) {
        half_second = real_add(real_mul(half_second, x), first);
        first = real_add(real_mul(first, x), value);
        value = real_add(real_mul(value, x), c[k]);
    }
    out[0] = value;
    out[1] = first;
    out[2] = real_times(half_second, 2);
}

/* By the chain rule: sigma(xi) xi' = F' gives the derivatives of xi in time, and these with those of each axis its motion. */
static void motion_in_space(const struct path *path, struct real xi,
                            const struct real f[QUANTITIES], struct motion *out)
{
    struct real d[3];
    taylor(path->sigma, xi, d);
    const struct real per_sigma = real_div(real_make(1, 0), d[0]);
    const struct real x1 = real_mul(f[0], per_sigma);
    const struct real square = real_mul(x1, x1);
    const struct real cube = real_mul(square, x1);
    const struct real x2 = real_mul(real_sub(f[1], real_mul(d[1], square)), per_sigma);
    const struct real mixed = real_times(real_mul(x1, x2), 3);
    const struct real bent = real_add(real_mul(d[2], cube), real_mul(d[1], mixed));
    const struct real x3 = real_mul(real_sub(f[2], bent), per_sigma);
    for (uint32_t axis = 0; axis < path->axis_count; axis++) {
        taylor(path->direction[axis], xi, d);
        out->of[axis][VELOCITY] = real_mul(d[0], x1);
        out->of[axis][ACCELERATION] = real_add(real_mul(d[1], square), real_mul(d[0], x2));
        out->of[axis][JERK] =
            real_add(real_add(real_mul(d[2], cube), real_mul(d[1], mixed)), real_mul(d[0], x3));
    }
}

static void motion_at(const struct cell *cell, struct real x, struct motion *out)
{
    const struct path *path = cell->path;
    struct real f[QUANTITIES];
    feed_at(cell, x, f);
    const struct real xi =
        parameter(path, real_add(horner(cell->c, WAY_DEGREE, x), cell->offset_mm));
    if (path->axis_count == PROGRAM_PLANE) {
        motion_in_plane(path, xi, f, out);
    } else {
        motion_in_space(path, xi, f, out);
    }
}

/* --- Majorants: coefficients that bound those of the Taylor series at every instant of a cell --- */

/* Of a polynomial c, at every instant within `half` of `middle`: out[k] bounds the coefficient of the power k of the distance from the
 * instant. */
static void majorant(struct real *out, const struct real *c, int degree, struct real middle,
                     struct real half)
{
    for (int k = 0; k <= degree; k++) {
        out[k] = c[k];
    }
    shift(out, degree, middle);
    for (int k = 0; k <= degree; k++) {
        out[k] = real_abs(out[k]);
    }
    shift(out, degree, half);
}

/* Coefficient n of the product a b. */
static struct real product_at(const struct real *a, const struct real *b, int n)
{
    struct real sum = zero;
    for (int k = 0; k <= n; k++) {
        sum = real_add(sum, real_mul(a[k], b[n - k]));
    }
    return sum;
}

/* Sum of polynomial[k] inner^k up to the power `orders`; inner has no constant term. */
static void compose(struct real out[ORDERS + 1], const struct real polynomial[PATH_DEGREE + 1],
                    const struct real inner[ORDERS + 1], int orders)
{
    for (int n = 0; n <= orders; n++) {
        out[n] = zero;
    }
    out[0] = polynomial[PATH_DEGREE];
    for (int k = PATH_DEGREE - 1; k >= 0; k--) {
        for (int n = orders; n >= 0; n--) { /* from above: it needs those below only */
            out[n] = product_at(out, inner, n);
        }
        out[0] = real_add(out[0], polynomial[k]);
    }
}

/* Of xi(x), counted from the instant: sigma(xi) xi' = F'. */
static void parameter_majorant(struct real xi[ORDERS + 1], const struct real way[WAY_DEGREE + 1],
                               const struct real sigma[PATH_DEGREE + 1], struct real per_sigma)
{
    struct real inverse[ORDERS];
    struct real speed[ORDERS + 1];
    xi[0] = zero;
    for (int order = 0; order < ORDERS; order++) {
        inverse[order] = per_sigma;
        if (order > 0) {
            struct real sum = zero;
            compose(speed, sigma, xi, order);
            for (int k = 1; k <= order; k++) {
                sum = real_add(sum, real_mul(speed[k], inverse[order - k]));
            }
            inverse[order] = real_mul(per_sigma, sum);
        }
        struct real sum = zero;
        for (int k = 0; k <= order; k++) {
            sum = real_add(sum, real_mul(real_times(way[k + 1], k + 1), inverse[order - k]));
        }
        xi[order + 1] = real_div(sum, real_make(order + 1, 0));
    }
}

/* Bounds of |q''| in x of velocity, acceleration and jerk of each axis, in their units of time. */
static void bend_of(const struct cell *cell, struct motion *out)
{
    const struct path *path = cell->path;
    const struct real one = real_make(1, 0);
    struct real way[WAY_DEGREE + 1];
    struct real polynomial[PATH_DEGREE + 1];
    struct real xi[ORDERS + 1];
    struct real slope[ORDERS];
    majorant(way, cell->c, WAY_DEGREE, zero, one);
    const struct real low =
        parameter(path, real_add(horner(cell->c, WAY_DEGREE, real_make(-1, 0)), cell->offset_mm));
    const struct real high =
        parameter(path, real_add(horner(cell->c, WAY_DEGREE, one), cell->offset_mm));
    const struct real middle = real_scale(real_add(low, high), -1);
    /* 2^-10 of it more, and 2^-20 of the segment: a feed may creep back by its slack */
    struct real half = real_abs(real_scale(real_sub(high, low), -1));
    half = real_add(real_mul(half, real_make(1025, -10)), real_make(1, -20));
    majorant(polynomial, path->sigma, PATH_DEGREE, middle, half);
    parameter_majorant(xi, way, polynomial, real_div(one, path->least_sigma));
    for (int k = 0; k < ORDERS; k++) {
        slope[k] = real_times(xi[k + 1], k + 1);
    }
    for (uint32_t axis = 0; axis < path->axis_count; axis++) {
        struct real direction[ORDERS + 1];
        majorant(polynomial, path->direction[axis], PATH_DEGREE, middle, half);
        compose(direction, polynomial, xi, ORDERS - 1);
        const struct real per_s2 = real_mul(cell->per_s, cell->per_s);
        out->of[axis][VELOCITY] =
            real_mul(real_times(product_at(direction, slope, 2), 2), cell->per_s);
        out->of[axis][ACCELERATION] =
            real_mul(real_times(product_at(direction, slope, 3), 6), per_s2);
        out->of[axis][JERK] = real_mul(real_times(product_at(direction, slope, 4), 24),
                                       real_mul(per_s2, cell->per_s));
    }
}

/* --- Against the limits --- */

/* The greatest of a quantity in one level. */
static void in_level(const struct program_override *own, uint32_t level,
                     const struct real at_one[QUANTITIES], struct real out[QUANTITIES])
{
    const int64_t f_q14 =
        level == PROGRAM_LEVEL_FULL ? own->factor_q14 : (int64_t)program_level_q9(level) * 32;
    const struct real f = real_make(f_q14, -14);
    const struct real f2 = real_make(f_q14 * f_q14, -28);
    const struct real f3 = real_make(f_q14 * f_q14 * f_q14, -42);
    const struct real rate = real_make((int64_t)program_number(own->rate[level]), -32);
    const struct real second = real_make((int64_t)program_number(own->second[level]), -24);
    const struct real mixed = real_times(real_mul(real_mul(f, rate), at_one[ACCELERATION]), 3);
    out[VELOCITY] = real_mul(f, at_one[VELOCITY]);
    out[ACCELERATION] =
        real_add(real_mul(f2, at_one[ACCELERATION]), real_mul(rate, at_one[VELOCITY]));
    out[JERK] =
        real_add(real_add(real_mul(f3, at_one[JERK]), mixed), real_mul(second, at_one[VELOCITY]));
}

/* At the rates that the piece allows: |lambda| <= f, |lambda'| <= R, |lambda''| <= S make of velocity, acceleration and jerk f v,
 * f^2 a + R v and f^3 j + 3 f R a + S v at most: the greatest of all levels. Magnitudes in, magnitudes out. docs/theory/numerics.md section 7. */
static void at_all_rates(const struct way *way, const struct real at_one[QUANTITIES],
                         struct real out[QUANTITIES])
{
    struct real magnitude[QUANTITIES];
    struct real own[QUANTITIES];
    for (int k = 0; k < QUANTITIES; k++) {
        magnitude[k] = real_abs(at_one[k]);
        out[k] = zero;
    }
    for (uint32_t level = 0; level < PROGRAM_LEVELS; level++) {
        in_level(&way->override, level, magnitude, own);
        for (int k = 0; k < QUANTITIES; k++) {
            out[k] = real_max(out[k], own[k]);
        }
    }
}

static int passes(struct real value, struct real limit)
{
    return limit.m != 0 && real_less(limit, value) != 0;
}

static const int codes[QUANTITIES] = {PROGRAM_ERR_AXIS_VELOCITY, PROGRAM_ERR_AXIS_ACCELERATION,
                                      PROGRAM_ERR_AXIS_JERK};

/* Takes a sample into the peaks. 0, or the code of the limit that it passes. */
static int take_sample(const struct check *check, const struct cell *cell, struct real x,
                       struct motion *peak)
{
    struct motion found;
    set_at_rest(&found);
    motion_at(cell, x, &found);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real values[QUANTITIES];
        at_all_rates(cell->way, found.of[axis], values);
        for (int k = 0; k < QUANTITIES; k++) {
            if (passes(values[k], check->limit[axis][k])) {
                return codes[k];
            }
            peak->of[axis][k] = real_max(peak->of[axis][k], values[k]);
        }
    }
    return 0;
}

/* 0 when nothing between samples 2 / parts apart in x can pass a limit, else the code of what may. */
static int judge(const struct check *check, const struct motion *peak, const struct motion *rise,
                 uint32_t parts_log2)
{
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            /* M h^2 / 8 with h = 2 / parts */
            const struct real between = real_scale(rise->of[axis][k], -1 - 2 * (int32_t)parts_log2);
            if (passes(real_add(peak->of[axis][k], between), check->limit[axis][k])) {
                return codes[k];
            }
        }
    }
    return 0;
}

/* One cell without halving: 0 kept, a code with *certain set when a sample passes a limit, else a code. */
static int check_cell(const struct check *check, const struct cell *cell, int *certain)
{
    struct motion bend;
    struct motion peak;
    int code = 0;
    set_at_rest(&peak);
    set_at_rest(&bend);
    bend_of(cell, &bend);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real values[QUANTITIES];
        at_all_rates(cell->way, bend.of[axis], values);
        for (int k = 0; k < QUANTITIES; k++) {
            bend.of[axis][k] = values[k];
        }
    }
    *certain = 1;
    for (uint32_t log2 = 0; (1u << log2) <= MOST_PARTS; log2++) {
        const uint32_t parts = 1u << log2;
        for (uint32_t i = 0; i <= parts; i++) {
            if (log2 == 0u || (i & 1u) != 0u) { /* the others have been looked at */
                const int32_t at = 2 * (int32_t)i - (int32_t)parts;
                code = take_sample(check, cell, real_make(at, -(int32_t)log2), &peak);
                if (code != 0) {
                    return code;
                }
            }
        }
        code = judge(check, &peak, &bend, log2);
        if (code == 0) {
            return 0;
        }
    }
    *certain = 0;
    return code;
}

static void set_cell(struct cell *cell, const struct way *way, const struct path *path,
                     struct real low, struct real high)
{
    const struct real half = real_scale(real_sub(high, low), -1);
    cell->way = way;
    cell->path = path;
    for (int k = 0; k <= WAY_DEGREE; k++) {
        cell->c[k] = way->c[k];
    }
    shift(cell->c, WAY_DEGREE, real_scale(real_add(low, high), -1));
    stretch(cell->c, WAY_DEGREE, half);
    cell->per_s = real_div(way->per_s, half);
    cell->offset_mm = real_make(way->start_q40_mm - path->start_q40_mm, -40);
}

/* Steps from the end of the cell before to the begin of this one: to a drive a step of velocity is an acceleration of step / period, and
 * so on. */
static int check_step(const struct check *check, const struct motion *now)
{
    const struct real share = real_div(real_make(LIMIT_CHECK_STEP_PERMILLE, 0), real_make(1000, 0));
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        struct real step[QUANTITIES];
        for (int k = VELOCITY; k <= ACCELERATION; k++) {
            step[k] = real_abs(real_sub(now->of[axis][k], check->last.of[axis][k]));
        }
        const struct real jump = real_mul(step[VELOCITY], check->per_period);
        const struct real jerk = real_mul(real_add(jump, step[ACCELERATION]), check->per_period);
        if (passes(jump, real_mul(check->limit[axis][ACCELERATION], share)) ||
            passes(jerk, real_mul(check->limit[axis][JERK], share))) {
            return PROGRAM_ERR_AXIS_STEP;
        }
    }
    return 0;
}

/* The stretch of a piece on one segment, halved where need be. */
static int check_stretch(struct check *check, const struct way *way, const struct path *path,
                         struct real low, struct real high)
{
    struct cell cell;
    struct motion now;
    const struct real width = real_sub(high, low);
    set_at_rest(&now);
    uint32_t at = 0; /* the cell from at to at + 1 of 2^halvings */
    int32_t halvings = 0;
    set_cell(&cell, way, path, low, high);
    motion_at(&cell, real_make(-1, 0), &now);
    int code = check->unknown != 0 ? 0 : check_step(check, &now);
    check->unknown = 0;
    motion_at(&cell, real_make(1, 0), &check->last);
    while (code == 0 && (at >> halvings) == 0u) {
        int certain = 0;
        const struct real part = real_scale(width, -halvings);
        const struct real from = real_add(low, real_times(part, (int32_t)at));
        set_cell(&cell, way, path, from, real_add(from, part));
        code = check_cell(check, &cell, &certain);
        if (code == 0) {
            at++;
            while ((at & 1u) == 0u && halvings > 0) {
                at >>= 1;
                halvings--;
            }
        } else if (certain == 0 && halvings < MOST_HALVINGS) {
            at <<= 1;
            halvings++;
            code = 0;
        }
    }
    return code;
}

/* u at which the piece comes to this way from its start, between `low` and 1. */
static struct real time_of(const struct way *way, struct real mm, struct real low)
{
    struct real high = real_make(1, 0);
    for (int step = 0; step < CUT_STEPS; step++) {
        const struct real middle = real_scale(real_add(low, high), -1);
        if (real_less(horner(way->c, WAY_DEGREE, middle), mm) != 0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return high;
}

static int64_t next_start(const struct program *p, uint32_t segment)
{
    return segment + 1u < p->header.segment_count ? program_segment_start(p, segment + 1u)
                                                  : INT64_MAX;
}

/* One piece, from the segment that it begins on; *segment is then the one that it ends on. */
static int check_piece(struct check *check, uint32_t piece, uint32_t *segment)
{
    const struct program *p = check->program;
    const struct real brief = real_make(1, -26);
    struct real low = zero;
    struct way way;
    struct path path;
    int code = 0;
    read_way(&way, p, piece);
    while (next_start(p, *segment) <= way.start_q40_mm) {
        (*segment)++;
    }
    read_path(&path, p, *segment);
    while (code == 0 && next_start(p, *segment) != INT64_MAX) {
        const struct real mm = real_make(next_start(p, *segment) - way.start_q40_mm, -40);
        if (real_less(mm, way.end_mm) == 0) {
            break;
        }
        const struct real cut = time_of(&way, mm, low);
        if (real_less(brief, real_sub(cut, low)) != 0) {
            code = check_stretch(check, &way, &path, low, cut);
            low = cut;
        }
        (*segment)++;
        read_path(&path, p, *segment);
    }
    if (code == 0 && real_less(brief, real_sub(real_make(1, 0), low)) != 0) {
        code = check_stretch(check, &way, &path, low, real_make(1, 0));
    }
    return code;
}

static void set_limits(struct check *check, const struct program_limits *limits)
{
    const struct real kept = real_make((1 << ROUNDING_BITS) - 1, -ROUNDING_BITS);
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        const struct real jerk = real_make((int64_t)limits->axis_jerk_mm_s3[axis], 0);
        check->limit[axis][VELOCITY] = real_mul(milli(limits->axis_velocity_um_s[axis]), kept);
        check->limit[axis][ACCELERATION] =
            real_mul(milli(limits->axis_acceleration_um_s2[axis]), kept);
        check->limit[axis][JERK] = real_mul(jerk, kept);
    }
}

static int any_limit(const struct check *check)
{
    int any = 0;
    for (uint32_t axis = 0; axis < check->axis_count; axis++) {
        for (int k = 0; k < QUANTITIES; k++) {
            any |= check->limit[axis][k].m;
        }
    }
    return any;
}

int limit_check_all(const struct program *p, const struct program_limits *limits, uint32_t *index)
{
    struct motion rest;
    struct check check = {.program = p, .axis_count = p->header.axis_count};
    uint32_t segment = 0;
    int code = 0;
    set_limits(&check, limits);
    set_at_rest(&rest);
    check.last = rest;
    check.unknown = (p->header.flags & PROGRAM_FLAG_MOVING) != 0;
    check.per_period = real_div(real_make(1000000, 0), real_make((int64_t)p->header.period_us, 0));
    *index = 0;
    if (any_limit(&check) == 0) {
        return 0;
    }
    for (uint32_t i = 0; i < p->header.piece_count && code == 0; i++) {
        *index = i;
        code = check_piece(&check, i, &segment);
        program_check_attend(limits);
    }
    code = code != 0 ? code : check_step(&check, &rest);
    *index = code != 0 ? *index : 0u;
    return code;
}
