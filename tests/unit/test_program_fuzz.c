/* SPDX-License-Identifier: MIT */
/*
 * Seeded mutations of golden programs, with a right CRC so that they reach the checks. Whatever happens, nothing is
 * read beyond the image and nothing is undefined (the sanitizers watch); and what is accepted runs: every kernel, at
 * two periods a tick, without a jump and without leaving the travel limits; and where the axes have limits, its
 * setpoints keep them. HODOGRAPH_FUZZ_CASES changes the number. Run by `make unit`; reads files of tests/data.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/interpolator.h"
#include "core/override_plan.h"
#include "golden.h"
#include "unity.h"

static const char *const seeds[] = {"line.hdgp",          "line_tiny.hdgp",    "line_slow.hdgp",
                                    "alpha_minimax.hdgp", "star_minimax.hdgp", "space3.hdgp",
                                    "space6.hdgp"};

void setUp(void)
{
}

void tearDown(void)
{
}

/* One change: a byte, a bit, a whole field to an extreme, a small step, or two fields swapped. */
static void mutate(uint8_t *image, uint32_t size, uint64_t *random)
{
    uint64_t r = golden_random(random);
    uint32_t at = (uint32_t)(r % size);
    uint32_t field = at & ~7u;
    uint8_t extreme[4][8] = {{0},
                             {255, 255, 255, 255, 255, 255, 255, 255},
                             {0, 0, 0, 0, 0, 0, 0, 128},
                             {255, 255, 255, 255, 255, 255, 255, 127}};
    switch ((r >> 32) % 5) {
    case 0:
        image[at] = (uint8_t)(r >> 40);
        break;
    case 1:
        image[at] ^= (uint8_t)(1u << ((r >> 40) & 7u));
        break;
    case 2:
        memcpy(image + field, extreme[(r >> 40) & 3u], size - field < 8 ? size - field : 8);
        break;
    case 3:
        image[field] = (uint8_t)(image[field] + ((r >> 40) & 7u) - 3u);
        break;
    default:
        if (field + 16 <= size) {
            memmove(image + field, image + field + 8, 8);
        }
        break;
    }
}

static void run_accepted(const struct program *p, const struct program_limits *limits)
{
    static struct interpolator it;
    struct interpolator_point point;
    uint64_t period = ((uint64_t)p->header.period_us << 42) / 1000000u;
    uint64_t duration = p->header.duration_q32_s << 10;
    uint64_t step = 2 * period;
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, p));
    uint64_t most = 300 * step;
    uint64_t from = duration > most ? duration - most : 0;
    TEST_ASSERT_EQUAL_INT(0, interpolator_seek(&it, from >> 10));
    for (uint64_t t = from; t <= duration + step; t += step) {
        int result = interpolator_at_q42(&it, t, &point);
        TEST_ASSERT_EQUAL_INT(t >= duration ? INTERPOLATOR_END : INTERPOLATOR_OK, result);
        for (uint32_t axis = 0; axis < p->header.axis_count; axis++) {
            const int64_t at = point.position_q40[axis];
            TEST_ASSERT_TRUE(at >= limits->min_q40_mm[axis] - (1 << 22));
            TEST_ASSERT_TRUE(at <= limits->max_q40_mm[axis] + (1 << 22));
        }
    }
}

/* What a drive sees between setpoints: differences over period, its square and its cube are means of velocity,
 * acceleration and jerk. Of four points, the last one first. */
static void keeps_axis_limits(const struct program_limits *limits, double period_s,
                              uint32_t axis_count, const double mm[4][PROGRAM_AXES])
{
    const double noise_mm = 1e-9; /* of the kernel, docs/theory/numerics.md section 10 */
    for (uint32_t axis = 0; axis < axis_count; axis++) {
        const double one = mm[0][axis] - mm[1][axis];
        const double two = one - (mm[1][axis] - mm[2][axis]);
        const double three = two - (mm[1][axis] - 2.0 * mm[2][axis] + mm[3][axis]);
        const double v = 1e-3 * limits->axis_velocity_um_s[axis] * period_s;
        const double a = 1e-3 * limits->axis_acceleration_um_s2[axis] * period_s * period_s;
        const double j = limits->axis_jerk_mm_s3[axis] * period_s * period_s * period_s;
        TEST_ASSERT_TRUE(fabs(one) <= v * 1.00001 + noise_mm);
        TEST_ASSERT_TRUE(fabs(two) <= a * 1.01 + 2.0 * noise_mm);
        TEST_ASSERT_TRUE(fabs(three) <= j * 1.02 + 4.0 * noise_mm);
    }
}

static void run_within_axis_limits(const struct program *p, const struct program_limits *limits)
{
    static struct interpolator it;
    const double unit = 1099511627776.0;
    const uint64_t period = ((uint64_t)p->header.period_us << 42) / 1000000u;
    const uint64_t duration = p->header.duration_q32_s << 10;
    struct interpolator_point point;
    double mm[4][PROGRAM_AXES];
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&it, p));
    for (uint32_t k = 0; k < 1000u && k * period <= duration + 3u * period; k++) {
        (void)interpolator_at_q42(&it, k * period, &point);
        memmove(mm[1], mm[0], 3 * sizeof mm[0]);
        for (uint32_t axis = 0; axis < p->header.axis_count; axis++) {
            mm[0][axis] = (double)point.position_q40[axis] / unit;
        }
        if (k >= 3u) {
            keeps_axis_limits(limits, 1e-6 * p->header.period_us, p->header.axis_count,
                              (const double (*)[PROGRAM_AXES])mm);
        }
    }
}

/* Every third image is one for a machine whose axes have limits: none, or nearly what the seeds need. */
static void set_axis_limits(struct program_limits *limits, uint64_t random)
{
    for (uint32_t axis = 0; axis < PROGRAM_AXES && random % 3u != 0u; axis++) {
        limits->axis_velocity_um_s[axis] = 100000u + (uint32_t)(random >> 8) % 100000u;
        limits->axis_acceleration_um_s2[axis] = 2000000u + (uint32_t)(random >> 16) % 3000000u;
        limits->axis_jerk_mm_s3[axis] = 50000u + (uint32_t)(random >> 24) % 200000u;
    }
}

static int try_image(uint8_t *image, uint32_t size, uint64_t random)
{
    struct program p;
    struct program_fault fault;
    struct program_limits limits = golden_no_limits();
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        limits.min_q40_mm[axis] = -((int64_t)300 << 40);
        limits.max_q40_mm[axis] = (int64_t)300 << 40;
    }
    set_axis_limits(&limits, random);
    golden_seal(image, size);
    if (program_open(&p, image, size) != 0 || program_check(&p, &limits, &fault) != 0) {
        return 0;
    }
    for (int kernel = KERNEL_FIXED; kernel <= KERNEL_DOUBLE; kernel++) {
        struct golden_precomputed precomputed;
        golden_precompute(&precomputed, &p, (enum kernel_number)kernel);
        run_accepted(&precomputed.program, &limits);
        if (kernel == KERNEL_DOUBLE && limits.axis_jerk_mm_s3[0] != 0u) {
            run_within_axis_limits(&precomputed.program, &limits);
        }
        golden_discard(&precomputed);
    }
    return 1;
}

static void test_mutations(void)
{
    const char *wanted = getenv("HODOGRAPH_FUZZ_CASES");
    long cases = wanted != NULL ? strtol(wanted, NULL, 10) : 20000;
    uint64_t random = 20240607;
    int accepted = 0;
    for (long i = 0; i < cases; i++) {
        uint32_t size = 0;
        uint8_t *image = golden_load(seeds[i % (long)(sizeof seeds / sizeof seeds[0])], &size);
        TEST_ASSERT_NOT_NULL(image);
        uint64_t changes = 1 + golden_random(&random) % 3;
        for (uint64_t k = 0; k < changes; k++) {
            mutate(image, size, &random);
        }
        accepted += try_image(image, size, golden_random(&random));
        free(image);
    }
    TEST_ASSERT_GREATER_THAN_INT(0, accepted);
    TEST_ASSERT_LESS_THAN_INT(cases, accepted);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_mutations);
    return UNITY_END();
}
