/* SPDX-License-Identifier: MIT */
/*
 * The fixed kernel at the corners of what the validator accepts (docs/theory/proofs.md section 15.3), under the
 * sanitizers: nothing overflows. Corners are segments at the ratio of 2, straight ones, both along an axis and turned,
 * as large as their power of four allows and just larger, from 32 mm down to where arc length is replaced. There too
 * its own functions are held to what the provers take for granted of them (tests/proofs/kernel_bounds.h), which is why
 * it is included whole. Run by `make unit`; no I/O.
 */
#include <math.h>
#include <string.h>

#include "../proofs/kernel_bounds.h"
#include "core/feed_piece.h"
#include "core/kernel_double.h"
#include "core/kernel_fixed.c" /* NOLINT(bugprone-suspicious-include) */
#include "golden.h"
#include "unity.h"

#define Q44        17592186044416.0
#define SHAPES     3000
#define TOLERANCE  256 /* 2^-32 mm in q40 */
#define OUTSIDE    128 /* 2^-33 mm */
#define TURNS      8
#define PLACES     16     /* on either side of the middle */
#define LAST_STEP  700000 /* of Newton's, in z: 2 * 1.6e-4, section 12 */
#define TOO_LITTLE 1e-9

static uint64_t seed;

void setUp(void)
{
    seed = 5;
}

void tearDown(void)
{
}

static double uniform(double from, double to)
{
    return from + (to - from) * ((double)(golden_random(&seed) >> 11) / 9007199254740992.0);
}

/* Bernstein coefficients of sigma; returns the greatest, and the least in *least. */
static double greatest_sigma(const double u[3], const double v[3], double *least)
{
    double b[5] = {u[0] * u[0] + v[0] * v[0], u[0] * u[1] + v[0] * v[1],
                   (u[0] * u[2] + v[0] * v[2] + 2 * (u[1] * u[1] + v[1] * v[1])) / 3,
                   u[1] * u[2] + v[1] * v[2], u[2] * u[2] + v[2] * v[2]};
    double greatest = b[0];
    *least = b[0];
    for (int k = 1; k < 5; k++) {
        *least = fmin(*least, b[k]);
        greatest = fmax(greatest, b[k]);
    }
    return greatest;
}

/* A shape that keeps the ratio, often with equality: the ends are drawn, the middle is stretched as far as it goes. */
static void draw(double u[3], double v[3])
{
    double least = 0;
    do {
        double straight = uniform(0, 1) < 0.3 ? 0.0 : 1.0;
        u[0] = 1;
        v[0] = 0;
        u[1] = uniform(0.4, 1.6);
        v[1] = straight * uniform(-1, 1);
        u[2] = uniform(-1.5, 1.5);
        v[2] = straight * uniform(-1.5, 1.5);
    } while (greatest_sigma(u, v, &least) > 1.999 * least || least < TOO_LITTLE);
    for (int step = 0; step < 20; step++) {
        double u_before = u[1];
        double v_before = v[1];
        double stretch = uniform(0.9, 1.1);
        u[1] *= stretch;
        v[1] *= stretch;
        if (greatest_sigma(u, v, &least) > 1.9999 * least) {
            u[1] = u_before;
            v[1] = v_before;
        }
    }
}

static void scale_and_turn(const double u[3], const double v[3], double scale, double angle,
                           struct program_segment *g)
{
    double c = angle == 0 ? 1.0 : cos(angle);
    double s = angle == 0 ? 0.0 : sin(angle);
    memset(g, 0, sizeof *g);
    g->axis_count = PROGRAM_PLANE;
    for (int k = 0; k < 3; k++) {
        g->a_q44[PROGRAM_U][k] = (int64_t)floor(scale * (u[k] * c - v[k] * s) * Q44);
        g->a_q44[PROGRAM_Q][k] = (int64_t)floor(scale * (u[k] * s + v[k] * c) * Q44);
    }
}

static int64_t size_of(int64_t a)
{
    return a < 0 ? -a : a;
}

/* s(z) from the middle, as newton_step adds it up. */
static int32_t arc_from_middle(const struct kernel_fixed_segment *k, int32_t z)
{
    int32_t value = k->arc.s_q30[5];
    for (int i = 4; i >= 1; i--) {
        value = qmath_mul_hi(value, z) + k->arc.s_q30[i];
    }
    return qmath_mul_hi(value, z);
}

/* At z, also where no arc length is: s(z), w, and sigma through its reciprocal, which the tangent refines. */
static void hold_at(const struct kernel_fixed_segment *k, int32_t z, int is_straight)
{
    int32_t reciprocal = slope_reciprocal_q15(&k->arc, z);
    int32_t half = arc_from_middle(k, z);
    TEST_ASSERT_TRUE(reciprocal >= RECIPROCAL_LEAST_Q15 && reciprocal <= RECIPROCAL_MOST_Q15);
    TEST_ASSERT_TRUE(z >= 0 ? half >= 0 : half <= 0);
    TEST_ASSERT_TRUE(size_of(half) <= HALF_MOST_Q30 && (size_of(z) < FAR_Z_Q31 || half != 0));
    int32_t u = quadratic(k->u_q28, z);
    int32_t v = quadratic(k->v_q28, z);
    TEST_ASSERT_TRUE(size_of(u) < W_BELOW_Q28 && size_of(v) < W_BELOW_Q28);
    int32_t sigma = qmath_mul_hi(u * 8, u * 8) + qmath_mul_hi(v * 8, v * 8);
    int32_t before = slope_reciprocal_q15(&k->arc, z < 0 ? z + LAST_STEP : z - LAST_STEP);
    int32_t error = (1 << 25) - qmath_mul_hi(sigma, before * (1 << 11));
    TEST_ASSERT_TRUE(is_straight || size_of(error) < ERROR_BELOW_Q25);
}

static void hold_to_contracts(const struct kernel_fixed_segment *k, int is_straight)
{
    for (int side = 0; side < 2; side++) {
        int32_t first = k->arc.inverse[side].g_q26[0] / 2;
        int32_t last = 3 * (1 << 26) - 2 * first - k->arc.inverse[side].g_q26[1] / 4;
        TEST_ASSERT_TRUE(first >= START_LEAST_Q26 && first <= START_MOST_Q26);
        TEST_ASSERT_TRUE(last >= START_LEAST_Q26 && last <= START_MOST_Q26);
        TEST_ASSERT_TRUE(k->arc.inverse[side].scale_q26 >= (1 << 27) - (1 << 18));
    }
    for (int i = -PLACES; i <= PLACES; i++) {
        hold_at(k, i * (INT32_MAX / PLACES), is_straight);
    }
    hold_at(k, INT32_MIN, is_straight);
}

/* Both kernels along the segment and just outside. Returns how far the fixed one is off. */
static int64_t evaluate(const struct program_segment *g)
{
    struct ph_segment ph;
    struct kernel_fixed_segment fixed;
    struct kernel_double_segment doubles;
    int64_t end_q48[PH_AXES];
    int64_t worst = 0;
    ph_segment_expand(&ph, g);
    ph_segment_end(&ph, end_q48);
    kernel_fixed_segment_set(&fixed, &ph);
    kernel_double_segment_set(&doubles, &ph);
    hold_to_contracts(&fixed, ph.a_q44[PROGRAM_U][0] == 0 && ph.a_q44[PROGRAM_Q][0] == 0);
    int64_t length = end_q48[PH_S] >> 8;
    for (int i = -1; i <= 9; i++) {
        int64_t at = i < 0 ? -OUTSIDE : i > 8 ? length + OUTSIDE : length / 8 * i;
        int64_t point[2];
        int64_t exact[2];
        kernel_fixed_segment_at(&fixed, point, at);
        kernel_double_segment_at(&doubles, exact, at);
        for (int axis = 0; axis < 2 && i >= 0 && i <= 8; axis++) {
            int64_t off = point[axis] - exact[axis];
            worst = off > worst ? off : -off > worst ? -off : worst;
        }
    }
    return worst;
}

/* The greatest coefficient of sigma is 2^n less or more a little; w is that of the shape. */
static void at_power(const double u[3], const double v[3], int n, double little, double angle)
{
    struct program_segment g;
    double least = 0;
    double scale = sqrt(ldexp(1 + little, n) / greatest_sigma(u, v, &least));
    scale_and_turn(u, v, scale, angle, &g);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(TOLERANCE, evaluate(&g));
}

static void test_corners_do_not_overflow(void)
{
    static const double littles[] = {-1e-13, -1e-11, -1e-9, -1e-8, -3e-8, -6e-8,
                                     -1e-7,  0,      1e-12, 1e-8,  1e-6};
    for (int i = 0; i < SHAPES; i++) {
        double u[3];
        double v[3];
        draw(u, v);
        int n = 6 - 2 * (int)(golden_random(&seed) % 21u);
        double little = littles[golden_random(&seed) % (sizeof littles / sizeof littles[0])];
        double turn = acos(-1.0) / (0.5 * TURNS) * (double)(golden_random(&seed) % TURNS);
        /* above 2^6 mm no segment is accepted */
        at_power(u, v, n, n == 6 ? -fabs(little) : little, turn);
    }
}

/* Found by the proof of ranges: |w| rounded up to 1 overflowed in the tangent. */
static void test_w_just_below_a_power_of_two(void)
{
    struct program_segment g;
    memset(&g, 0, sizeof g);
    g.axis_count = PROGRAM_PLANE;
    g.a_q44[PROGRAM_U][0] = 17592186042818;
    g.a_q44[PROGRAM_U][1] = 17592186042763;
    g.a_q44[PROGRAM_U][2] = 17592184512282;
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int k = 0; k < 3; k++) {
            g.a_q44[PROGRAM_U][k] *= sign;
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT64(TOLERANCE, evaluate(&g));
    }
}

/* Coefficients of one sign whose weighted sum in q44 is just below 2^bits: all 31 bits of the slope are used. */
static void fill_up(struct program_piece *c, int bits, int sign)
{
    int64_t rest = ((int64_t)1 << (bits - 4)) - 1; /* of the sum of k |c_k| in q40 */
    for (int k = 7; k >= 1; k--) {
        int64_t most = rest / k;
        int64_t part = k == 1 ? most : (int64_t)(uniform(0, 1) * uniform(0, 1) * (double)most);
        part = part < (int64_t)1 << 54 ? part : (int64_t)1 << 54;
        c->c_q40_mm[k - 1] = sign * part;
        rest -= k * part;
    }
}

static void test_feed_with_a_full_slope_does_not_overflow(void)
{
    for (int i = 0; i < SHAPES; i++) {
        struct program_piece c;
        struct feed_piece feed;
        struct feed_point at;
        memset(&c, 0, sizeof c);
        int sign = golden_random(&seed) % 4u == 0 ? -1 : 1;
        fill_up(&c, 20 + i % 43, sign);
        c.duration_q32_s = (uint64_t)1 << (golden_random(&seed) % 55u);
        c.duration_q32_s -= golden_random(&seed) % 2u != 0 && c.duration_q32_s > 2 ? 1 : 0;
        feed_piece_set(&feed, &c);
        uint64_t end = (c.duration_q32_s << 10) - 1u;
        for (uint64_t t = 0; t < 5; t++) {
            feed_piece_at(&feed, &at, end - t * t * t);
            feed_piece_at(&feed, &at, end / 5u * t);
        }
        TEST_ASSERT_TRUE(sign * at.feed_q32_mm_s >= -64);
    }
}

/* A sum of negative slopes that rounding alone would carry past 31 bits: one is full, each other a unit of q40. */
static void test_feed_slopes_rounded_away_from_zero_do_not_overflow(void)
{
    for (int shift = 5; shift <= 27; shift++) {
        struct program_piece c;
        struct feed_piece feed;
        struct feed_point at;
        memset(&c, 0, sizeof c);
        for (int k = 0; k < 7; k++) {
            c.c_q40_mm[k] = -1;
        }
        c.c_q40_mm[0] -= (int64_t)INT32_MAX << (shift - 4);
        c.duration_q32_s = (uint64_t)1 << 40;
        feed_piece_set(&feed, &c);
        feed_piece_at(&feed, &at, (c.duration_q32_s << 10) - 1u);
        TEST_ASSERT_TRUE(at.feed_q32_mm_s < 0);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_corners_do_not_overflow);
    RUN_TEST(test_feed_with_a_full_slope_does_not_overflow);
    RUN_TEST(test_feed_slopes_rounded_away_from_zero_do_not_overflow);
    RUN_TEST(test_w_just_below_a_power_of_two);
    return UNITY_END();
}
