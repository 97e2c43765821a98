/* SPDX-License-Identifier: MIT */
/* Implements core/path_motion.h (see there): the motion of the path axes on one segment, and bounds of it. Used by the
 * proofs of axis limits (core/limit_check.h, core/brake_check.h); docs/theory/proofs.md section 16 has the formulas.
 * Pure, main loop. */
#include "core/path_motion.h"

#include "core/ph_segment.h"

#define ORDERS        5     /* of time, in majorants: jerk'' is the fifth derivative of the point */
#define NEWTON_STEPS  4     /* at most */
#define SMALL_STEP    (-18) /* log2 of a Newton step after which the error is below the rounding */
#define ROUNDING_BITS 14

static const struct real zero = {0, 0};

static void clear_axis(struct motion *out, uint32_t axis)
{
    for (int k = 0; k < QUANTITIES; k++) {
        out->of[axis][k] = zero;
    }
}

void path_motion_clear(struct motion *out)
{
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        clear_axis(out, axis);
    }
}

static struct real milli(uint32_t value)
{
    const struct real thousand = real_make(1000, 0);
    return real_div(real_make((int64_t)value, 0), thousand);
}

int path_motion_limits(struct motion *out, const struct program_limits *limits, uint32_t axis_count)
{
    const struct real kept = real_make((1 << ROUNDING_BITS) - 1, -ROUNDING_BITS);
    int32_t any = 0;
    path_motion_clear(out);
    for (uint32_t axis = 0; axis < axis_count; axis++) {
        struct real *own = out->of[axis];
        own[VELOCITY] = real_mul(milli(limits->axis_velocity_um_s[axis]), kept);
        own[ACCELERATION] = real_mul(milli(limits->axis_acceleration_um_s2[axis]), kept);
        own[JERK] = real_mul(real_make((int64_t)limits->axis_jerk_mm_s3[axis], 0), kept);
        any |= own[VELOCITY].m | own[ACCELERATION].m | own[JERK].m;
    }
    return any != 0 ? 1 : 0;
}

struct real path_motion_horner(const struct real *c, int degree, struct real x)
{
    struct real value = c[degree];
    for (int k = degree - 1; k >= 0; k--) {
        value = real_add(real_mul(value, x), c[k]);
    }
    return value;
}

void path_motion_taylor(struct real *c, int degree, struct real at, int count)
{
    for (int k = 0; k < count; k++) {
        for (int i = degree - 1; i >= k; i--) {
            c[i] = real_add(c[i], real_mul(c[i + 1], at));
        }
    }
}

/* The last coefficient stays. */
void path_motion_shift(struct real *c, int degree, struct real by)
{
    path_motion_taylor(c, degree, by, degree);
}

/* c(x) becomes c(by x). */
void path_motion_stretch(struct real *c, int degree, struct real by)
{
    struct real power = by;
    for (int k = 1; k <= degree; k++) {
        c[k] = real_mul(c[k], power);
        power = real_mul(power, by);
    }
}

/* --- Reading the image --- */

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

/* Length and the least Bernstein coefficient of sigma; the middle one comes times 3. It is half of the greatest at
 * least. */
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

void path_motion_read(struct path *path, const struct program *p, uint32_t i)
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

void path_motion_read_piece(struct feed_polynomial *poly, const struct program *p, uint32_t i)
{
    struct program_piece piece;
    program_piece_get(p, i, &piece);
    const int e = program_piece_exponent(piece.duration_q32_s);
    const struct real duration_s = real_make((int64_t)piece.duration_q32_s, -32);
    poly->c[0] = zero;
    for (int k = 1; k <= FEED_DEGREE; k++) {
        poly->c[k] = real_make(piece.c_q40_mm[k - 1], -40);
    }
    path_motion_stretch(poly->c, FEED_DEGREE, real_scale(duration_s, -e));
    poly->per_s = real_div(real_make(1, 0), duration_s);
    poly->override = piece.override;
    poly->start_q40_mm = piece.start_q40_mm;
    poly->end_mm = path_motion_horner(poly->c, FEED_DEGREE, real_make(1, 0));
}

/* --- The motion at an instant --- */

/* xi at an arc length of the segment; the curve is continued beyond its ends. */
static struct real parameter(const struct path *path, struct real s_mm)
{
    struct real xi = real_div(s_mm, path->length_mm);
    for (int step = 0; step < NEWTON_STEPS; step++) {
        const struct real s = real_mul(path_motion_horner(path->arc, PATH_DEGREE, xi), xi);
        const struct real by =
            real_div(real_sub(s, s_mm), path_motion_horner(path->sigma, PATH_DEGREE, xi));
        xi = real_sub(xi, by);
        if (real_less(real_abs(by), real_make(1, SMALL_STEP)) != 0) {
            break;
        }
    }
    return xi;
}

/* With tangent T = w^2 / sigma and curvature kappa: velocity F' T, acceleration (F'' + i kappa F'^2) T, jerk
 * (F''' - kappa^2 F'^3 + i (3 kappa F' F'' + kappa_s F'^3)) T. docs/theory/proofs.md 16. */
static void motion_in_plane(const struct path *path, struct real xi,
                            const struct real f[QUANTITIES], struct motion *out)
{
    struct real w[PROGRAM_PLANE];
    struct real w1[PROGRAM_PLANE];
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        w[axis] = path_motion_horner(path->w[axis], 2, xi);
        w1[axis] = real_add(path->w[axis][1], real_times(real_mul(path->w[axis][2], xi), 2));
    }
    const struct real sigma = path_motion_horner(path->sigma, PATH_DEGREE, xi);
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
    const struct real tx =
        real_mul(path_motion_horner(path->direction[0], PATH_DEGREE, xi), per_sigma);
    const struct real ty =
        real_mul(path_motion_horner(path->direction[1], PATH_DEGREE, xi), per_sigma);
    out->of[0][VELOCITY] = real_mul(f[0], tx);
    out->of[1][VELOCITY] = real_mul(f[0], ty);
    out->of[0][ACCELERATION] = real_sub(real_mul(f[1], tx), real_mul(normal, ty));
    out->of[1][ACCELERATION] = real_add(real_mul(f[1], ty), real_mul(normal, tx));
    out->of[0][JERK] = real_sub(real_mul(along, tx), real_mul(across, ty));
    out->of[1][JERK] = real_add(real_mul(along, ty), real_mul(across, tx));
}

/* 1 when an axis does not move on the segment. */
static int is_still(const struct path *path, uint32_t axis)
{
    int32_t any = 0;
    for (int k = 0; k <= PATH_DEGREE; k++) {
        any |= path->direction[axis][k].m;
    }
    return any == 0 ? 1 : 0;
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

/* By the chain rule: sigma(xi) xi' = F' gives the derivatives of xi in time, and these with those of each axis its
 * motion. */
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
        if (is_still(path, axis) != 0) {
            clear_axis(out, axis);
            continue;
        }
        taylor(path->direction[axis], xi, d);
        out->of[axis][VELOCITY] = real_mul(d[0], x1);
        out->of[axis][ACCELERATION] = real_add(real_mul(d[1], square), real_mul(d[0], x2));
        out->of[axis][JERK] =
            real_add(real_add(real_mul(d[2], cube), real_mul(d[1], mixed)), real_mul(d[0], x3));
    }
}

void path_motion_at(const struct path *path, struct real s_mm, const struct real f[QUANTITIES],
                    struct motion *out)
{
    const struct real xi = parameter(path, s_mm);
    if (path->axis_count == PROGRAM_PLANE) {
        motion_in_plane(path, xi, f, out);
    } else {
        motion_in_space(path, xi, f, out);
    }
}

/* --- Majorants: coefficients that bound those of the Taylor series at every instant of a cell --- */

/* Of a polynomial c, at every instant within `half` of `middle`: out[k] bounds the coefficient of the power k of the
 * distance from the instant. */
static void majorant(struct real *out, const struct real *c, int degree, struct real middle,
                     struct real half)
{
    for (int k = 0; k <= degree; k++) {
        out[k] = c[k];
    }
    path_motion_shift(out, degree, middle);
    for (int k = 0; k <= degree; k++) {
        out[k] = real_abs(out[k]);
    }
    path_motion_shift(out, degree, half);
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

/* Of the feed polynomial, at every instant from x = -1 to 1: `majorant` with middle 0 and half 1, which needs no products. */
static void feed_majorant(struct real out[FEED_DEGREE + 1], const struct real c[FEED_DEGREE + 1])
{
    for (int k = 0; k <= FEED_DEGREE; k++) {
        out[k] = real_abs(c[k]);
    }
    for (int k = 0; k < FEED_DEGREE; k++) {
        for (int i = FEED_DEGREE - 1; i >= k; i--) {
            out[i] = real_add(out[i], out[i + 1]);
        }
    }
}

/* Of xi(x), counted from the instant, and of its powers: of[m][n] is the coefficient n of the power m. It has none below m. */
struct parameter_powers {
    struct real of[PATH_DEGREE + 1][ORDERS + 1];
};

/* The coefficients n of the powers from the second one on; those below n, and n of the first power, are known. */
static void powers_at(struct parameter_powers *xi, int n)
{
    for (int m = 2; m <= n && m <= PATH_DEGREE; m++) {
        struct real sum = zero;
        for (int i = 1; i <= n - m + 1; i++) {
            sum = real_add(sum, real_mul(xi->of[1][i], xi->of[m - 1][n - i]));
        }
        xi->of[m][n] = sum;
    }
}

/* Coefficient n of a polynomial of xi(x). */
static struct real composed_at(const struct real polynomial[PATH_DEGREE + 1],
                               const struct parameter_powers *xi, int n)
{
    struct real sum = n == 0 ? polynomial[0] : zero;
    for (int m = 1; m <= n && m <= PATH_DEGREE; m++) {
        sum = real_add(sum, real_mul(polynomial[m], xi->of[m][n]));
    }
    return sum;
}

/* xi(x) from sigma(xi) xi' = F'. */
static void parameter_majorant(struct parameter_powers *xi, const struct real poly[FEED_DEGREE + 1],
                               const struct real sigma[PATH_DEGREE + 1], struct real per_sigma)
{
    struct real inverse[ORDERS]; /* of sigma */
    struct real own[ORDERS];     /* of sigma(xi) */
    for (int order = 0; order < ORDERS; order++) {
        struct real sum = zero;
        inverse[order] = per_sigma;
        if (order > 0) {
            powers_at(xi, order);
            own[order] = composed_at(sigma, xi, order);
            for (int k = 1; k <= order; k++) {
                sum = real_add(sum, real_mul(own[k], inverse[order - k]));
            }
            inverse[order] = real_mul(per_sigma, sum);
            sum = zero;
        }
        for (int k = 0; k <= order; k++) {
            sum = real_add(sum, real_mul(real_times(poly[k + 1], k + 1), inverse[order - k]));
        }
        xi->of[1][order + 1] = real_div(sum, real_make(order + 1, 0));
    }
}

/* A lower bound of sigma within `half` of `middle`. */
static struct real least_sigma(const struct path *path, struct real middle, struct real half)
{
    struct real c[PATH_DEGREE + 1];
    for (int k = 0; k <= PATH_DEGREE; k++) {
        c[k] = path->sigma[k];
    }
    path_motion_shift(c, PATH_DEGREE, middle);
    path_motion_stretch(c, PATH_DEGREE, half);
    struct real least = c[0];
    for (int k = 1; k <= PATH_DEGREE; k++) {
        least = real_sub(least, real_abs(c[k]));
    }
    return real_max(real_mul(least, real_make(1023, -10)), path->least_sigma);
}

void path_motion_bend(const struct path *path, const struct real c[FEED_DEGREE + 1],
                      struct real per_s, struct real offset_mm, struct motion *out)
{
    const struct real one = real_make(1, 0);
    struct real poly[FEED_DEGREE + 1];
    struct real polynomial[PATH_DEGREE + 1];
    struct parameter_powers xi;
    struct real slope[ORDERS];
    feed_majorant(poly, c);
    const struct real low =
        parameter(path, real_add(path_motion_horner(c, FEED_DEGREE, real_make(-1, 0)), offset_mm));
    const struct real high =
        parameter(path, real_add(path_motion_horner(c, FEED_DEGREE, one), offset_mm));
    const struct real middle = real_scale(real_add(low, high), -1);
    /* 2^-10 of it more, and 2^-20 of the segment: a feed may go back by its slack */
    struct real half = real_abs(real_scale(real_sub(high, low), -1));
    half = real_add(real_mul(half, real_make(1025, -10)), real_make(1, -20));
    majorant(polynomial, path->sigma, PATH_DEGREE, middle, half);
    parameter_majorant(&xi, poly, polynomial, real_div(one, least_sigma(path, middle, half)));
    for (int k = 0; k < ORDERS; k++) {
        slope[k] = real_times(xi.of[1][k + 1], k + 1);
    }
    const struct real per_s2 = real_mul(per_s, per_s);
    for (uint32_t axis = 0; axis < path->axis_count; axis++) {
        struct real direction[ORDERS];
        if (is_still(path, axis) != 0) {
            clear_axis(out, axis);
            continue;
        }
        majorant(polynomial, path->direction[axis], PATH_DEGREE, middle, half);
        for (int n = 0; n < ORDERS; n++) {
            direction[n] = composed_at(polynomial, &xi, n);
        }
        out->of[axis][VELOCITY] = real_mul(real_times(product_at(direction, slope, 2), 2), per_s);
        out->of[axis][ACCELERATION] =
            real_mul(real_times(product_at(direction, slope, 3), 6), per_s2);
        out->of[axis][JERK] =
            real_mul(real_times(product_at(direction, slope, 4), 24), real_mul(per_s2, per_s));
    }
}
