/* SPDX-License-Identifier: MIT */
/* Tests of offline/contour.h: contour error. Run by `make unit`; no I/O. */
#include "offline/contour.h"

#include <math.h>
#include <string.h>

#include "unity.h"

enum { SEGMENTS = 24 };

/* A program made by hand: the header's fields and the segments are all that the module reads. */
static uint8_t image[PROGRAM_HEADER_SIZE + SEGMENTS * PROGRAM_SEGMENT_SIZE];
static struct program program;
static struct contour_segment expanded[SEGMENTS];
static struct contour contour;

/* The same curve in the plainest form: w by Bernstein, r and s by Gauss quadrature, exact for these
 * degrees. */
static double w[SEGMENTS][3][2];
static double start[SEGMENTS + 1][2];
static double arc[SEGMENTS + 1];

static uint32_t seed;

static double random_within(double low, double high)
{
    seed = seed * 1664525u + 1013904223u;
    return low + (high - low) * (double)(seed >> 8) / 16777216.0;
}

static void hodograph(int i, double xi, double out[2])
{
    double a[2];
    for (int j = 0; j < 2; j++) {
        a[j] = w[i][0][j] * (1 - xi) * (1 - xi) + 2 * w[i][1][j] * xi * (1 - xi) +
               w[i][2][j] * xi * xi;
    }
    out[0] = a[0] * a[0] - a[1] * a[1];
    out[1] = 2 * a[0] * a[1];
}

static void integrate(int i, double xi, double point[2], double *length)
{
    static const double node[3] = {0.11270166537925831, 0.5, 0.88729833462074169};
    static const double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    point[0] = start[i][0];
    point[1] = start[i][1];
    *length = arc[i];
    for (int k = 0; k < 3; k++) {
        double h[2];
        hodograph(i, xi * node[k], h);
        point[0] += xi * weight[k] * h[0];
        point[1] += xi * weight[k] * h[1];
        *length += xi * weight[k] * hypot(h[0], h[1]);
    }
}

static void put(uint8_t *at, double value, double scale)
{
    const uint64_t bits = (uint64_t)llrint(value * scale);
    for (int b = 0; b < 8; b++) {
        at[b] = (uint8_t)(bits >> (8 * b));
    }
}

static void encode(int i)
{
    const double q40 = 1099511627776.0, q44 = 17592186044416.0;
    uint8_t *at = image + PROGRAM_HEADER_SIZE + (size_t)i * PROGRAM_SEGMENT_SIZE;
    put(at, arc[i], q40);
    put(at + 8, start[i][0], q40);
    put(at + 16, start[i][1], q40);
    for (int k = 0; k < 6; k++) {
        put(at + 24 + 8 * k, w[i][k / 2][k % 2], q44);
    }
}

static void begin(int count, bool closed)
{
    for (int i = 0; i < count; i++) {
        integrate(i, 1.0, start[i + 1], &arc[i + 1]);
        encode(i);
    }
    memset(&program, 0, sizeof program);
    program.image = image;
    program.size = sizeof image;
    program.header.axis_count = PROGRAM_PLANE;
    program.header.header_size = PROGRAM_HEADER_SIZE;
    program.header.segment_count = (uint32_t)count;
    program.header.flags = closed ? PROGRAM_FLAG_CLOSED : 0;
    program.header.length_q40_mm = llrint(arc[count] * 1099511627776.0);
    contour_begin(&contour, &program, expanded);
}

/* A smooth wandering curve: w turns (by up to `bend` rad a coefficient) and breathes slowly, C1 at the joints. */
static void wander(double bend)
{
    double angle = 0.3, size = 2.0;
    for (int i = 0; i < SEGMENTS; i++) {
        for (int k = 0; k < 3; k++) {
            if (i > 0 && k == 0) {
                memcpy(w[i][0], w[i - 1][2], sizeof w[i][0]);
                continue;
            }
            if (i > 0 && k == 1) {
                w[i][1][0] = 2 * w[i][0][0] - w[i - 1][1][0];
                w[i][1][1] = 2 * w[i][0][1] - w[i - 1][1][1];
                continue;
            }
            angle = atan2(w[i][k == 2 ? 1 : 0][1], w[i][k == 2 ? 1 : 0][0]) +
                    random_within(-bend, bend);
            size = random_within(1.9, 2.1);
            w[i][k][0] = size * cos(angle);
            w[i][k][1] = size * sin(angle);
        }
    }
    start[0][0] = -17.0;
    start[0][1] = 400.0;
    begin(SEGMENTS, false);
}

static void line(void)
{
    w[0][0][0] = w[0][1][0] = w[0][2][0] = 2.0; /* 4 mm along x */
    w[0][0][1] = w[0][1][1] = w[0][2][1] = 0.0;
    start[0][0] = 10.0;
    start[0][1] = -1.0;
    begin(1, false);
}

void setUp(void)
{
    seed = 12345;
    memset(w, 0, sizeof w);
    arc[0] = 0.0;
}

void tearDown(void)
{
}

static double distance(double arc_length_mm, double x_mm, double y_mm)
{
    const double point[3] = {x_mm, y_mm};
    return contour_distance_mm(&contour, arc_length_mm, point);
}

static void test_distance_from_a_line_and_its_ends(void)
{
    line();
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.25, distance(1.0, 11.125, -0.75));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.0, distance(3.0, 12.5, -1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.5, distance(0.0, 9.7, -0.6));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.5, distance(4.0, 14.3, -1.4));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.0003, distance(0.0, 9.9997, -1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.5, distance(900.0, 14.3, -1.4));
}

/* Points set off along the normal: the foot is known. Half the smallest radius is far beyond 0.3 mm
 * here. */
static void test_known_feet_with_lag_and_lead(void)
{
    wander(0.1);
    for (int n = 0; n < 20000; n++) {
        const int i = (int)random_within(0, SEGMENTS);
        const double xi = random_within(i == 0 ? 0.2 : 0.0, i == SEGMENTS - 1 ? 0.8 : 1.0);
        const double away = random_within(-0.3, 0.3) * random_within(0, 1) * random_within(0, 1);
        double h[2], point[2], s;
        hodograph(i, xi, h);
        integrate(i, xi, point, &s);
        const double speed = hypot(h[0], h[1]);
        const double lag = random_within(-0.4, 0.4);
        const double found =
            distance(s + lag, point[0] - away * h[1] / speed, point[1] + away * h[0] / speed);
        TEST_ASSERT_DOUBLE_WITHIN(2e-12, fabs(away), found);
    }
}

/* The answer does not depend on the order of asking. */
static void test_history_does_not_matter(void)
{
    wander(0.1);
    double first[200];
    for (int n = 0; n < 200; n++) {
        const double s = arc[SEGMENTS] * n / 199.0;
        double point[2], length;
        integrate(n * SEGMENTS / 200, 0.5, point, &length);
        first[n] = distance(s, point[0] + 0.01, point[1]);
    }
    for (int n = 199; n >= 0; n--) {
        const double s = arc[SEGMENTS] * n / 199.0;
        double point[2], length;
        integrate(n * SEGMENTS / 200, 0.5, point, &length);
        TEST_ASSERT_TRUE(first[n] == distance(s, point[0] + 0.01, point[1]));
    }
}

/* Distance from the nearest of dense samples at most `window` along the curve from arc length s. */
static double nearest_sample(const double point[2], double s, double window)
{
    double nearest = 1e9;
    for (int k = 0; k < (int)contour.count * 200; k++) {
        double p[2], length;
        integrate(k / 200, (k % 200) / 200.0, p, &length);
        if (fabs(length - s) < window) {
            nearest = fmin(nearest, hypot(point[0] - p[0], point[1] - p[1]));
        }
    }
    return nearest;
}

/* Far away, Newton may go astray: the answer must be a place within the window all the same, and no further than
 * the nearest one within half of it. The curve is curly, so other branches are often nearer. */
static void test_far_points_get_the_nearest_place_in_the_window(void)
{
    wander(0.5);
    for (int n = 0; n < 400; n++) {
        const int i = (int)random_within(2, SEGMENTS - 2);
        double at[2], s;
        integrate(i, 0.5, at, &s);
        const double point[3] = {at[0] + random_within(-2, 2), at[1] + random_within(-2, 2)};
        const double gap = hypot(point[0] - at[0], point[1] - at[1]);
        const double found = distance(s, point[0], point[1]);
        TEST_ASSERT_TRUE(found <= gap + 1e-12);
        TEST_ASSERT_TRUE(found >= nearest_sample(point, s, 4.2 * gap + 0.1) - 0.01);
    }
}

/* w = 2 exp(i angle), one turn of the tangent in 12 segments: near enough a circle, closed by its
 * last segment. */
static void ring(void)
{
    const double turn = 2 * acos(-1.0) / 12 / 2; /* of w in one segment */
    for (int i = 0; i < 12; i++) {
        for (int k = 0; k < 3; k++) {
            const double angle = turn * (i + 0.5 * k);
            const double size = k == 1 ? 2.0 / cos(turn / 2) : 2.0;
            w[i][k][0] = size * cos(angle);
            w[i][k][1] = size * sin(angle);
        }
    }
    start[0][0] = start[0][1] = 5.0;
    begin(12, true);
}

static void test_closed_path_goes_on_beyond_its_start(void)
{
    ring();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5.0, start[12][0]);
    for (int n = 0; n < 200; n++) {
        const double xi = random_within(0.9, 1.0), away = random_within(-0.2, 0.2);
        double h[2], point[2], s;
        hodograph(11, xi, h);
        integrate(11, xi, point, &s);
        const double speed = hypot(h[0], h[1]);
        const double x = point[0] - away * h[1] / speed, y = point[1] + away * h[0] / speed;
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, fabs(away), distance(0.0, x, y));
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, fabs(away), distance(arc[12], x, y));
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, fabs(away), distance(0.3, x, y));
    }
}

/* Near the centre all places are far and nearly equal: the search, across the seam. */
static void test_centre_of_a_closed_path(void)
{
    ring();
    double middle[2], length;
    integrate(5, 1.0, middle, &length); /* opposite the start */
    for (int n = 0; n < 50; n++) {
        const double point[2] = {(5.0 + middle[0]) / 2 + random_within(-2, 2),
                                 (5.0 + middle[1]) / 2 + random_within(-2, 2)};
        const double nearest = nearest_sample(point, 0.0, 1e9);
        const double found = distance(0.0, point[0], point[1]);
        TEST_ASSERT_TRUE(found <= nearest + 1e-9);
        TEST_ASSERT_TRUE(found >= nearest - 1e-3);
    }
}

static void test_many_points_in_counts(void)
{
    line();
    const int64_t s[2] = {0, INT64_C(2) << 40};
    const int32_t act[4] = {10000000, -1000250, 12000000, -999999};
    double errors[2];
    const uint32_t counts_per_unit[2] = {1000000, 1000000};
    contour_errors_um(&contour, 2, s, act, 2, counts_per_unit, errors);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.25, errors[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.001, errors[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_distance_from_a_line_and_its_ends);
    RUN_TEST(test_known_feet_with_lag_and_lead);
    RUN_TEST(test_history_does_not_matter);
    RUN_TEST(test_far_points_get_the_nearest_place_in_the_window);
    RUN_TEST(test_closed_path_goes_on_beyond_its_start);
    RUN_TEST(test_centre_of_a_closed_path);
    RUN_TEST(test_many_points_in_counts);
    return UNITY_END();
}
