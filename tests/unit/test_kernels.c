/* SPDX-License-Identifier: MIT */
/*
 * The kernels on random segments that reach the limit of the speed ratio, from 32 mm to 1e-10 mm long: the bounds of
 * docs/theory/numerics.md sections 9 to 12. (Against 50-digit arithmetic: benchmarks/kernels.py.) Run by `make unit`;
 * no I/O.
 */
#include <string.h>

#include "core/crc32.h"
#include "core/kernel_double.h"
#include "core/kernel_fixed.h"
#include "core/kernel_float.h"
#include "core/qmath.h"
#include "golden.h"
#include "unity.h"

#define SEGMENTS 20000
#define POINTS   8

static uint64_t seed;
static struct ph_segment ph;
static struct kernel_fixed_segment fixed;
static struct kernel_float_segment floats;
static struct kernel_double_segment doubles;

void setUp(void)
{
    seed = 11;
}

void tearDown(void)
{
}

static double uniform(double from, double to)
{
    return from + (to - from) * ((double)(golden_random(&seed) >> 11) / 9007199254740992.0);
}

static double ratio_of_speed(const double u[3], const double v[3])
{
    double b[5] = {u[0] * u[0] + v[0] * v[0], u[0] * u[1] + v[0] * v[1],
                   (u[0] * u[2] + v[0] * v[2] + 2 * (u[1] * u[1] + v[1] * v[1])) / 3,
                   u[1] * u[2] + v[1] * v[2], u[2] * u[2] + v[2] * v[2]};
    double least = b[0];
    double greatest = b[0];
    for (int k = 1; k < 5; k++) {
        least = b[k] < least ? b[k] : least;
        greatest = b[k] > greatest ? b[k] : greatest;
    }
    return least > 0 ? greatest / least : 1e30;
}

/* w0 = 1 up to scale and rotation, which random_segment adds. */
static void draw(double u[3], double v[3])
{
    u[0] = 1;
    v[0] = 0;
    do {
        u[1] = uniform(-2.5, 2.5);
        v[1] = uniform(-2.5, 2.5);
        u[2] = uniform(-1.5, 1.5);
        v[2] = uniform(-1.5, 1.5);
    } while (ratio_of_speed(u, v) > 1.999);
}

static void random_segment(struct program_segment *g, int binary_exponent)
{
    double u[3];
    double v[3];
    double c = uniform(-1, 1);
    double s = uniform(-1, 1);
    double scale = 17592186044416.0;
    draw(u, v);
    memset(g, 0, sizeof *g);
    g->axis_count = PROGRAM_PLANE;
    for (int i = binary_exponent; i < 0; i++) {
        scale *= 0.5;
    }
    for (int i = binary_exponent; i > 0; i--) {
        scale *= 2;
    }
    for (int k = 0; k < 3; k++) {
        g->a_q44[PROGRAM_U][k] = (int64_t)(scale * (c * u[k] - s * v[k]));
        g->a_q44[PROGRAM_Q][k] = (int64_t)(scale * (c * v[k] + s * u[k]));
    }
    g->start_q40_mm = (int64_t)(golden_random(&seed) >> 3);
    g->point_q40_mm[0] = (int64_t)golden_random(&seed) >> 12;
    g->point_q40_mm[1] = (int64_t)golden_random(&seed) >> 12;
}

static int64_t worst_of(const int64_t a[2], const int64_t b[2])
{
    int64_t x = a[0] > b[0] ? a[0] - b[0] : b[0] - a[0];
    int64_t y = a[1] > b[1] ? a[1] - b[1] : b[1] - a[1];
    return x > y ? x : y;
}

static void compare_at(int64_t arc_q40)
{
    int64_t a[2];
    int64_t b[2];
    int64_t c[2];
    kernel_fixed_segment_at(&fixed, a, arc_q40);
    kernel_float_segment_at(&floats, b, arc_q40);
    kernel_double_segment_at(&doubles, c, arc_q40);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(8, worst_of(a, c));                /* 2^-37 mm */
    TEST_ASSERT_LESS_OR_EQUAL_INT64((int64_t)1 << 22, worst_of(b, c)); /* 2^-18 mm = 3.8 nm */
}

static void test_kernels_agree_at_the_limit_of_the_ratio(void)
{
    for (int i = 0; i < SEGMENTS; i++) {
        struct program_segment g;
        int64_t end_q48[PH_AXES];
        random_segment(&g, (int)(golden_random(&seed) % 19u) - 17);
        ph_segment_expand(&ph, &g);
        ph_segment_end(&ph, end_q48);
        if (end_q48[PH_S] > (int64_t)32 << 48) {
            continue;
        }
        kernel_fixed_segment_set(&fixed, &ph);
        kernel_float_segment_set(&floats, &ph);
        kernel_double_segment_set(&doubles, &ph);
        int64_t length_q40 = end_q48[PH_S] >> 8;
        compare_at(g.start_q40_mm);
        compare_at(g.start_q40_mm + length_q40);
        for (int k = 0; k < POINTS; k++) {
            compare_at(g.start_q40_mm + (int64_t)(uniform(0, 1) * (double)length_q40));
        }
    }
}

static uint32_t add_to_crc(uint32_t crc, int64_t value)
{
    uint8_t bytes[8];
    for (int i = 0; i < 8; i++) {
        bytes[i] = (uint8_t)((uint64_t)value >> (8 * i));
    }
    return crc32_update(crc, bytes, sizeof bytes);
}

static uint32_t add_path_bits(uint32_t crc)
{
    struct program_segment g;
    int64_t point[2];
    random_segment(&g, (int)(golden_random(&seed) % 18u) - 17);
    ph_segment_expand(&ph, &g);
    kernel_fixed_segment_set(&fixed, &ph);
    int64_t length_q40 = 2 * ph.c_q48_mm[PH_S][0] >> 8;
    for (int k = 0; k <= POINTS; k++) {
        kernel_fixed_segment_at(&fixed, point, g.start_q40_mm + length_q40 / POINTS * k);
        crc = add_to_crc(add_to_crc(crc, point[0]), point[1]);
    }
    return crc;
}

static uint32_t add_feed_bits(uint32_t crc)
{
    struct program_piece piece = {.duration_q32_s = (golden_random(&seed) >> 28) + 1u};
    struct feed_piece feed;
    struct feed_point point;
    for (int k = 0; k < 7; k++) {
        piece.c_q40_mm[k] = (int64_t)golden_random(&seed) >> 19;
    }
    feed_piece_set(&feed, &piece);
    for (uint64_t k = 0; k < POINTS; k++) {
        feed_piece_at(&feed, &point, (piece.duration_q32_s << 10) / POINTS * k);
        crc = add_to_crc(add_to_crc(crc, point.arc_length_q40_mm), point.feed_q32_mm_s);
    }
    return crc;
}

/* Recorded runs and the hashes of their setpoints hang on these bits. */
static void test_fixed_bits_never_change(void)
{
    uint32_t path = 0;
    uint32_t feed = 0;
    for (int i = 0; i < 2000; i++) {
        path = add_path_bits(path);
        feed = add_feed_bits(feed);
    }
    TEST_ASSERT_EQUAL_HEX32(0x6323ECB4, path);
    TEST_ASSERT_EQUAL_HEX32(0x70858CB0, feed);
}

/* At the two ends the fixed kernel is at the end points of the segment. */
static void test_ends_are_met(void)
{
    for (int i = 0; i < SEGMENTS; i++) {
        struct program_segment g;
        int64_t end_q48[PH_AXES];
        int64_t a[2];
        random_segment(&g, 1);
        ph_segment_expand(&ph, &g);
        ph_segment_end(&ph, end_q48);
        if (end_q48[PH_S] > (int64_t)32 << 48) {
            continue;
        }
        kernel_fixed_segment_set(&fixed, &ph);
        kernel_fixed_segment_at(&fixed, a, g.start_q40_mm);
        TEST_ASSERT_INT64_WITHIN(4, g.point_q40_mm[0], a[0]);
        TEST_ASSERT_INT64_WITHIN(4, g.point_q40_mm[1], a[1]);
        kernel_fixed_segment_at(&fixed, a, g.start_q40_mm + qmath_round(end_q48[PH_S], 8));
        TEST_ASSERT_INT64_WITHIN(4, g.point_q40_mm[0] + qmath_round(end_q48[PH_X], 8), a[0]);
        TEST_ASSERT_INT64_WITHIN(4, g.point_q40_mm[1] + qmath_round(end_q48[PH_Y], 8), a[1]);
    }
}

/* A straight line along x of sigma = 4 mm: every coefficient is known. */
static void test_expansion_of_a_line(void)
{
    const int64_t two = (int64_t)2 << 44;
    struct program_segment g = {.axis_count = PROGRAM_PLANE, .a_q44 = {{two, two, two}}};
    ph_segment_expand(&ph, &g);
    TEST_ASSERT_INT64_WITHIN(4, (int64_t)2 << 48, ph.c_q48_mm[PH_X][0]);
    TEST_ASSERT_INT64_WITHIN(4, (int64_t)2 << 48, ph.c_q48_mm[PH_X][1]);
    TEST_ASSERT_INT64_WITHIN(4, (int64_t)2 << 48, ph.c_q48_mm[PH_S][1]);
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_EQUAL_INT64(0, ph.c_q48_mm[PH_Y][k]);
    }
    TEST_ASSERT_EQUAL_INT(4, ph.exponent);
    TEST_ASSERT_INT64_WITHIN(32, (int64_t)4 << 50, ph.sigma_q50_mm[1]);
}

/* 2^14 mm in 2^-32 s is 2^46 mm/s and overflows q32: given as 2^29 at least, beyond all that is shown. */
static void test_absurd_feeds_are_held(void)
{
    const int64_t most = (int64_t)1 << 62;
    struct program_piece piece = {.duration_q32_s = 1, .c_q40_mm = {(int64_t)1 << 54}};
    struct feed_piece integers;
    struct kernel_double_piece exact;
    struct feed_point point;
    for (int sign = 1; sign >= -1; sign -= 2) {
        feed_piece_set(&integers, &piece);
        feed_piece_at(&integers, &point, 0);
        TEST_ASSERT_TRUE(sign * point.feed_q32_mm_s > most / 4 &&
                         sign * point.feed_q32_mm_s < most);
        kernel_double_piece_set(&exact, &piece);
        kernel_double_piece_at(&exact, &point, 0);
        TEST_ASSERT_EQUAL_INT64(sign * most, point.feed_q32_mm_s);
        piece.c_q40_mm[0] = -piece.c_q40_mm[0];
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_kernels_agree_at_the_limit_of_the_ratio);
    RUN_TEST(test_fixed_bits_never_change);
    RUN_TEST(test_ends_are_met);
    RUN_TEST(test_expansion_of_a_line);
    RUN_TEST(test_absurd_feeds_are_held);
    return UNITY_END();
}
