/* SPDX-License-Identifier: MIT */
/*
 * Seeded mutations of golden programs, with a right CRC so that they reach the checks. Whatever happens, nothing
 * is read beyond the image and nothing is undefined (the sanitizers watch); and what is accepted runs: every kernel, at
 * two periods a tick, without a jump and without leaving the travel limits. HODOGRAPH_FUZZ_CASES changes the number.
 */
#include <stdlib.h>
#include <string.h>

#include "core/interp.h"
#include "core/timebase.h"
#include "golden.h"
#include "unity.h"

static const char *const seeds[] = {"line.hdgp", "line_tiny.hdgp", "line_slow.hdgp",
                                    "alpha_minimax.hdgp", "star_minimax.hdgp"};

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

static void run_accepted(const struct program *p, const struct program_limits *limits,
                         enum interp_kernel kernel)
{
    static struct interp it;
    struct interp_point point;
    uint64_t period = ((uint64_t)p->header.period_us << 42) / 1000000u;
    uint64_t duration = p->header.duration_q32_s << 10;
    uint64_t step = 2 * period;
    TEST_ASSERT_EQUAL_INT(0, interp_begin(&it, p, kernel));
    uint64_t most = 300 * step;
    uint64_t from = duration > most ? duration - most : 0;
    TEST_ASSERT_EQUAL_INT(0, interp_seek(&it, from >> 10));
    for (uint64_t t = from; t <= duration + step; t += step) {
        int result = interp_at_q42(&it, t, &point);
        TEST_ASSERT_EQUAL_INT(t >= duration ? INTERP_END : INTERP_OK, result);
        TEST_ASSERT_TRUE(point.x_q40_mm >= limits->min_q40_mm[0] - (1 << 22));
        TEST_ASSERT_TRUE(point.x_q40_mm <= limits->max_q40_mm[0] + (1 << 22));
        TEST_ASSERT_TRUE(point.y_q40_mm >= limits->min_q40_mm[1] - (1 << 22));
        TEST_ASSERT_TRUE(point.y_q40_mm <= limits->max_q40_mm[1] + (1 << 22));
    }
}

static int try_image(uint8_t *image, uint32_t size)
{
    struct program p;
    struct program_fault fault;
    struct program_limits limits = golden_no_limits();
    for (int axis = 0; axis < 2; axis++) {
        limits.min_q40_mm[axis] = -((int64_t)300 << 40);
        limits.max_q40_mm[axis] = (int64_t)300 << 40;
    }
    golden_seal(image, size);
    if (program_open(&p, image, size) != 0 || program_check(&p, &limits, &fault) != 0) {
        return 0;
    }
    for (int kernel = INTERP_FIXED; kernel <= INTERP_DOUBLE; kernel++) {
        run_accepted(&p, &limits, (enum interp_kernel)kernel);
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
        accepted += try_image(image, size);
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
