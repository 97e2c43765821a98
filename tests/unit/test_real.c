/* SPDX-License-Identifier: MIT */
/* real: against double, over the range that checks use. Run by `make unit`; no I/O. */
#include <math.h>

#include "core/real.h"
#include "golden.h"
#include "unity.h"

#define CASES 200000

void setUp(void)
{
}

void tearDown(void)
{
}

static double value(struct real a)
{
    return ldexp((double)a.m, a.e);
}

/* Any sign, any number of bits, now and then zero. */
static struct real any(uint64_t *random)
{
    const uint64_t r = golden_random(random);
    const int64_t m = (int64_t)golden_random(random) >> (r & 63u);
    return real_make(r % 50u == 0u ? 0 : m, (int32_t)(r >> 32) % 120);
}

static void normal(struct real a)
{
    const int64_t size = a.m < 0 ? -(int64_t)a.m : a.m;
    TEST_ASSERT_TRUE(size == 0 || (size >= (int64_t)1 << 30 && size < (int64_t)1 << 31));
}

static void near(double wanted, struct real found, double scale)
{
    normal(found);
    TEST_ASSERT_TRUE(fabs(value(found) - wanted) <= ldexp(scale, -29));
}

static void test_made_from_any_integer(void)
{
    TEST_ASSERT_EQUAL_INT32(0, real_make(0, 77).m);
    near(ldexp(-1.0, 63), real_make(INT64_MIN, 0), ldexp(1.0, 63));
    near(ldexp(1.0, 63), real_make(INT64_MAX, 0), ldexp(1.0, 63));
    for (int bits = 0; bits < 63; bits++) {
        const int64_t m = (int64_t)1 << bits;
        TEST_ASSERT_TRUE(value(real_make(m, -5)) == ldexp((double)m, -5));
        TEST_ASSERT_TRUE(value(real_make(-m, 5)) == -ldexp((double)m, 5));
    }
}

static void test_arithmetic(void)
{
    uint64_t random = 11;
    for (int i = 0; i < CASES; i++) {
        const struct real a = any(&random);
        const struct real b = any(&random);
        const double x = value(a);
        const double y = value(b);
        near(x + y, real_add(a, b), fmax(fabs(x), fabs(y)));
        near(x - y, real_sub(a, b), fmax(fabs(x), fabs(y)));
        near(x * y, real_mul(a, b), fabs(x * y));
        near(-7.0 * x, real_times(a, -7), fabs(7.0 * x));
        near(fabs(x), real_abs(a), 0.0);
        near(ldexp(x, -9), real_scale(a, -9), 0.0);
        near(fmax(x, y), real_max(a, b), 0.0);
        TEST_ASSERT_EQUAL_INT(x < y, real_less(a, b));
        TEST_ASSERT_EQUAL_INT(0, real_less(a, a));
        if (b.m != 0) {
            near(x / y, real_div(a, b), fabs(x / y));
        }
    }
}

/* Rounding down must not make the mantissa one bit longer. */
static void test_products_next_to_a_power_of_two(void)
{
    for (int32_t k = -3; k <= 3; k++) {
        for (int32_t i = 2; i <= 9; i++) {
            const struct real a = real_make(-((1 << 30) + i), 0);
            const struct real b = real_make(INT32_MAX - 2 * i + k, 0);
            near(value(a) * value(b), real_mul(a, b), fabs(value(a) * value(b)));
            near(value(a) * value(a), real_mul(a, a), value(a) * value(a));
        }
    }
}

static void test_terms_far_apart(void)
{
    const struct real one = real_make(1, 0);
    TEST_ASSERT_TRUE(value(real_add(one, real_make(-1, -40))) == 1.0);
    TEST_ASSERT_EQUAL_INT32(0, real_sub(one, one).m);
    near(ldexp(1.0, -30), real_sub(real_make((1 << 30) + 1, -30), one), 1.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_made_from_any_integer);
    RUN_TEST(test_arithmetic);
    RUN_TEST(test_products_next_to_a_power_of_two);
    RUN_TEST(test_terms_far_apart);
    return UNITY_END();
}
