/* SPDX-License-Identifier: MIT */
/* Tests of core/interpolator.h: program time in, point on the path out. Run by `make unit`; reads files of
 * tests/data. */
#include "core/interpolator.h"

#include "core/override_plan.h"
#include "golden.h"
#include "unity.h"

#define NANOMETRE_Q40 ((int64_t)1099512) /* 1e-6 mm */

static const char *const names[] = {"alpha_exponential.hdgp", "heart_minimax.hdgp",
                                    "star_minimax.hdgp",      "line_tiny.hdgp",
                                    "line_slow.hdgp",         "alpha_offset.hdgp"};
#define NAMES (sizeof names / sizeof names[0])

static struct program p;
static struct golden_precomputed precomputed[KERNELS];
static struct interpolator it;
static struct interpolator_point a, b;

static void open(const char *name)
{
    golden_open(&p, name);
    for (uint32_t kernel = 0; kernel < KERNELS; kernel++) {
        golden_precompute(&precomputed[kernel], &p, (enum kernel_number)kernel);
    }
}

static void close(void)
{
    for (uint32_t kernel = 0; kernel < KERNELS; kernel++) {
        golden_discard(&precomputed[kernel]);
    }
    golden_close(&p);
}

void setUp(void)
{
    open("alpha_minimax.hdgp");
}

void tearDown(void)
{
    close();
}

static void assert_same_point(void)
{
    TEST_ASSERT_EQUAL_INT64(a.arc_length_q40_mm, b.arc_length_q40_mm);
    TEST_ASSERT_EQUAL_INT64(a.position_q40[0], b.position_q40[0]);
    TEST_ASSERT_EQUAL_INT64(a.position_q40[1], b.position_q40[1]);
    TEST_ASSERT_EQUAL_INT64(a.feed_q32_mm_s, b.feed_q32_mm_s);
}

static void test_refuses_nonsense(void)
{
    const struct program nothing = {.image = NULL};
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_PROGRAM, interpolator_begin(&it, NULL));
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_PROGRAM, interpolator_begin(&it, &nothing));
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_COEFFICIENTS, interpolator_begin(&it, &p));
}

static void test_begins_at_the_start(void)
{
    struct program_segment first;
    program_segment_get(&p, 0, &first);
    for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
        interpolator_begin(&it, &precomputed[kernel].program);
        TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at_q42(&it, 0, &a));
        TEST_ASSERT_EQUAL_INT64(0, a.arc_length_q40_mm);
        TEST_ASSERT_INT64_WITHIN(10 * NANOMETRE_Q40, first.point_q40_mm[0], a.position_q40[0]);
        TEST_ASSERT_INT64_WITHIN(10 * NANOMETRE_Q40, first.point_q40_mm[1], a.position_q40[1]);
    }
}

/* The end is the same bits in every kernel, and the alpha ends at its last control point, 18i. */
static void test_ends_exactly(void)
{
    for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
        interpolator_begin(&it, &precomputed[kernel].program);
        TEST_ASSERT_EQUAL_INT(INTERPOLATOR_END, interpolator_at(&it, p.header.duration_q32_s, &a));
        TEST_ASSERT_EQUAL_INT(INTERPOLATOR_END, interpolator_at(&it, UINT64_MAX, &b));
        assert_same_point();
        TEST_ASSERT_EQUAL_INT64(p.header.length_q40_mm, a.arc_length_q40_mm);
        TEST_ASSERT_INT64_WITHIN(64, 0, a.position_q40[0]);
        TEST_ASSERT_INT64_WITHIN(64, (int64_t)18 << 40, a.position_q40[1]);
        TEST_ASSERT_EQUAL_INT64(0, a.feed_q32_mm_s);
    }
}

/* Without records: the first point and the last one. */
static void test_ends_are_those_of_a_run(void)
{
    for (uint32_t kernel = 0; kernel < KERNELS; kernel++) {
        struct interpolator_point first, last;
        interpolator_begin(&it, &precomputed[kernel].program);
        interpolator_ends(&p, kernel_find(kernel), &first, &last);
        interpolator_at(&it, 0, &a);
        b = first;
        assert_same_point();
        interpolator_at(&it, p.header.duration_q32_s, &a);
        b = last;
        assert_same_point();
    }
}

/* A run, and single points reached by seeks in random order, give the same bits. */
static void test_point_depends_on_time_only(void)
{
    static struct interpolator other;
    uint64_t random = 1;
    for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
        interpolator_begin(&it, &precomputed[kernel].program);
        interpolator_begin(&other, &precomputed[kernel].program);
        uint64_t duration = p.header.duration_q32_s << 10;
        uint64_t time = 0;
        while (time < duration) {
            TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at_q42(&it, time, &a));
            interpolator_seek(&other, golden_random(&random) % duration >> 10);
            interpolator_seek(&other, time >> 10);
            TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at_q42(&other, time, &b));
            assert_same_point();
            time += golden_random(&random) % ((uint64_t)8 << 32);
        }
    }
}

static void test_jumps_are_refused(void)
{
    interpolator_begin(&it, &precomputed[KERNEL_FIXED].program);
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_JUMP,
                          interpolator_at(&it, p.header.duration_q32_s - 1u, &a));
    TEST_ASSERT_EQUAL_INT(0, interpolator_seek(&it, p.header.duration_q32_s - 1u));
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at(&it, p.header.duration_q32_s - 1u, &a));
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_ERR_JUMP, interpolator_at(&it, 0, &a));
    TEST_ASSERT_EQUAL_INT(0, interpolator_seek(&it, 0));
    TEST_ASSERT_EQUAL_INT(INTERPOLATOR_OK, interpolator_at(&it, 0, &a));
}

static int64_t distance(int64_t u, int64_t v)
{
    return u > v ? u - v : v - u;
}

/* All kernels agree on every tick of every golden program: fixed within 1 nm / 1000 of double, float
 * within 10 nm. */
static void compare_kernels(void)
{
    static struct interpolator floating, exact;
    struct interpolator_point c;
    struct program_clock clock;
    struct override_plan plan;
    interpolator_begin(&it, &precomputed[KERNEL_FIXED].program);
    interpolator_begin(&floating, &precomputed[KERNEL_FLOAT].program);
    interpolator_begin(&exact, &precomputed[KERNEL_DOUBLE].program);
    program_clock_begin(&clock, &precomputed[KERNEL_FIXED].program, p.header.period_us, 0);
    override_plan_begin(&plan, &p);
    for (uint32_t tick = 0; tick < program_ticks(&p); tick++) {
        const uint64_t time = override_plan_tick(&plan, &clock);
        TEST_ASSERT_LESS_OR_EQUAL_INT(1, (unsigned)interpolator_at_q42(&it, time, &a));
        TEST_ASSERT_LESS_OR_EQUAL_INT(1, (unsigned)interpolator_at_q42(&floating, time, &b));
        TEST_ASSERT_LESS_OR_EQUAL_INT(1, (unsigned)interpolator_at_q42(&exact, time, &c));
        TEST_ASSERT_LESS_THAN_INT64(NANOMETRE_Q40 / 1000,
                                    distance(a.position_q40[0], c.position_q40[0]));
        TEST_ASSERT_LESS_THAN_INT64(NANOMETRE_Q40 / 1000,
                                    distance(a.position_q40[1], c.position_q40[1]));
        TEST_ASSERT_LESS_THAN_INT64(10 * NANOMETRE_Q40,
                                    distance(b.position_q40[0], c.position_q40[0]));
        TEST_ASSERT_LESS_THAN_INT64(10 * NANOMETRE_Q40,
                                    distance(b.position_q40[1], c.position_q40[1]));
    }
    TEST_ASSERT_EQUAL_UINT64(clock.duration_q42_s, clock.time_q42_s);
    TEST_ASSERT_EQUAL_INT64(p.header.length_q40_mm, a.arc_length_q40_mm);
}

static void test_kernels_agree(void)
{
    for (unsigned i = 0; i < NAMES; i++) {
        close();
        open(names[i]);
        compare_kernels();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_refuses_nonsense);
    RUN_TEST(test_begins_at_the_start);
    RUN_TEST(test_ends_exactly);
    RUN_TEST(test_ends_are_those_of_a_run);
    RUN_TEST(test_point_depends_on_time_only);
    RUN_TEST(test_jumps_are_refused);
    RUN_TEST(test_kernels_agree);
    return UNITY_END();
}
