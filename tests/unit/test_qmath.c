/* SPDX-License-Identifier: MIT */
/* The integer helpers against plain 128-bit-free identities and small cases that can be computed by hand. Run by
 * `make unit`; no I/O. */
#include "core/qmath.h"

#include "core/bernstein.h"
#include "core/qwide.h"
#include "golden.h"
#include "unity.h"

#define CASES 20000

static uint64_t seed;

void setUp(void)
{
    seed = 7;
}

void tearDown(void)
{
}

/* Of any size: a random number of leading bits is dropped. */
static int64_t any(int bits)
{
    int64_t a = (int64_t)golden_random(&seed);
    return a >> (64 - bits + (int)(golden_random(&seed) % (unsigned)(bits - 1)));
}

static void test_leading_zeros(void)
{
    for (int i = 0; i < 64; i++) {
        TEST_ASSERT_EQUAL_INT(63 - i, qmath_clz64((uint64_t)1 << i));
        TEST_ASSERT_EQUAL_INT(63 - i, qmath_clz64(((uint64_t)2 << i) - 1u));
    }
}

/* mul_wide drops a bit, mul_unsigned and mul_hi are floors. */
static void test_wide_products(void)
{
    for (int i = 0; i < CASES; i++) {
        int64_t a = any(62) >> 31;
        int32_t b = (int32_t)any(32);
        int64_t exact = a * b; /* below 2^62 */
        int64_t low = qmath_mul_wide(a, b);
        TEST_ASSERT_INT64_WITHIN(1, exact >> 32, low);
        TEST_ASSERT_EQUAL_INT64(a * b, qmath_mul_wide(a * ((int64_t)1 << 32), b));
        TEST_ASSERT_EQUAL_INT64((a * (uint32_t)b) >> 32, qmath_mul_unsigned(a, (uint32_t)b));
        TEST_ASSERT_EQUAL_INT32((int32_t)(((int64_t)(int32_t)a * b) >> 32),
                                qmath_mul_hi((int32_t)a, b));
    }
}

/* (a + c) b = a b + c b within the rounding, and exact where the product fits 63 bits. */
static void test_product_q44(void)
{
    for (int i = 0; i < CASES; i++) {
        int64_t a = any(31);
        int64_t b = any(31);
        TEST_ASSERT_EQUAL_INT64((a * b) >> 38, qmath_mul_q44(a, b));
        a = any(50);
        b = any(49);
        int64_t c = any(49);
        int64_t sum = qmath_mul_q44(b, a) + qmath_mul_q44(c, a);
        TEST_ASSERT_INT64_WITHIN(1, qmath_mul_q44(b + c, a), sum);
    }
}

static void test_divisions(void)
{
    for (int i = 0; i < CASES; i++) {
        int64_t a = any(62);
        uint32_t b = (uint32_t)any(32) | 1u;
        TEST_ASSERT_EQUAL_UINT64((uint64_t)a / b, qmath_div_u64((uint64_t)a, b));
        TEST_ASSERT_INT64_WITHIN(2, a / 3, qmath_third(a));
        TEST_ASSERT_INT64_WITHIN(2, a / 5, qmath_fifth(a));
    }
    TEST_ASSERT_EQUAL_UINT64(UINT64_MAX, qmath_div_u64(UINT64_MAX, 1));
    for (int i = 0; i < 200000; i++) {
        uint64_t a = golden_random(&seed) >> (golden_random(&seed) % 64u);
        uint64_t b = golden_random(&seed) >> (golden_random(&seed) % 64u);
        uint64_t c = a - a % (b | 1u);
        TEST_ASSERT_EQUAL_UINT64(a / (b | 1u), qmath_div_u64(a, b | 1u));
        TEST_ASSERT_EQUAL_UINT64(c / (b | 1u), qmath_div_u64(c, b | 1u));
        TEST_ASSERT_EQUAL_UINT64((c - 1u) / (b | 1u), qmath_div_u64(c - 1u, b | 1u));
    }
}

/* docs/theory/proofs.md section 15.2: never above floor(a / n), less than 2.1 below a / n. Multiples, their
 * neighbours, powers of two, and the ends of the range, where 2^-64 |a| is largest. */
static void test_thirds_and_fifths_at_the_corners(void)
{
    const int64_t most = ((int64_t)1 << 62) - 1;
    for (int bits = 1; bits <= 62; bits++) {
        for (int64_t near = -16; near <= 16; near++) {
            int64_t a = ((int64_t)1 << bits) + near;
            a = a > most ? most + near - 16 : a;
            for (int sign = -1; sign <= 1; sign += 2) {
                int64_t third = sign * a - 3 * qmath_third(sign * a);
                int64_t fifth = sign * a - 5 * qmath_fifth(sign * a);
                TEST_ASSERT_TRUE(third >= 0 && third <= 6);
                TEST_ASSERT_TRUE(fifth >= 0 && fifth <= 10);
            }
        }
    }
}

static void test_shifts(void)
{
    const int64_t most = ((int64_t)1 << 62) - 1;
    TEST_ASSERT_EQUAL_INT64(-2, qmath_shift(-3, -1));
    TEST_ASSERT_EQUAL_INT64(-24, qmath_shift(-3, 3));
    TEST_ASSERT_EQUAL_INT64(-24, qmath_shift_clamp(-3, 3));
    TEST_ASSERT_EQUAL_INT64(-1, qmath_shift_clamp(-3, -90));
    TEST_ASSERT_EQUAL_INT64(0, qmath_shift_clamp(3, -90));
    TEST_ASSERT_EQUAL_INT64(0, qmath_shift_clamp(0, 90));
    TEST_ASSERT_EQUAL_INT64(most, qmath_shift_clamp(3, 61));
    TEST_ASSERT_EQUAL_INT64(-most, qmath_shift_clamp(-1, 90));
    TEST_ASSERT_EQUAL_INT64(most, qmath_shift_clamp(INT64_MAX, 0));
    TEST_ASSERT_EQUAL_INT64(2, qmath_round(3, 1));
    TEST_ASSERT_EQUAL_INT64(-1, qmath_round(-3, 1));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, qmath_clamp32(INT64_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, qmath_clamp32((int64_t)1 << 31));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, qmath_clamp32(-((int64_t)1 << 31)));
}

/* (a + b)^2 - (a - b)^2 = 4 a b, exactly. */
static void test_exact_products(void)
{
    const struct qwide zero = {0, 0};
    for (int i = 0; i < CASES; i++) {
        int64_t a = any(49);
        int64_t b = any(49);
        struct qwide left = qwide_add_product(zero, a + b, a + b, 1);
        left = qwide_add_product(left, a - b, a - b, -1);
        struct qwide right = qwide_add_product(zero, a, b, 4);
        TEST_ASSERT_EQUAL_INT(0, qwide_compare(left, right));
        TEST_ASSERT_EQUAL_INT(a == 0 || b == 0     ? 0
                              : (a < 0) == (b < 0) ? 1
                                                   : -1,
                              qwide_compare(right, zero));
        TEST_ASSERT_EQUAL_INT(
            0, qwide_compare(qwide_abs(right), qwide_abs(qwide_add_product(zero, -a, b, 4))));
        struct qwide quarter = qwide_shift_down(right, 2);
        TEST_ASSERT_EQUAL_INT(0, qwide_compare(quarter, qwide_add_product(zero, a, b, 1)));
    }
}

static void test_sizes_and_order(void)
{
    for (int i = 0; i < CASES; i++) {
        int64_t a = any(62);
        int64_t b = any(62);
        TEST_ASSERT_EQUAL_INT64(a < 0 ? -a : a, qmath_magnitude(a));
        TEST_ASSERT_EQUAL_INT64(qmath_magnitude(a - b), qmath_greater(a, b) - qmath_lesser(a, b));
        TEST_ASSERT_EQUAL_INT64(a + b, qmath_greater(a, b) + qmath_lesser(a, b));
    }
}

/* Binomial coefficients: (1 + t)^n has b[j] = 2^j-like values that are known: all a[k] = C(n,k) give 2^j. */
static void test_bernstein_of_a_binomial(void)
{
    const int64_t powers[4][8] = {{1, 4, 6, 4, 1},
                                  {1, 5, 10, 10, 5, 1},
                                  {1, 6, 15, 20, 15, 6, 1},
                                  {1, 7, 21, 35, 35, 21, 7, 1}};
    const int64_t scales[4] = {12, 10, 60, 105};
    int64_t b[8];
    for (int n = 4; n <= 7; n++) {
        TEST_ASSERT_EQUAL_INT64(scales[n - 4], bernstein_from_powers(powers[n - 4], n, b));
        for (int j = 0; j <= n; j++) {
            TEST_ASSERT_EQUAL_INT64(scales[n - 4] << j, b[j]);
        }
    }
    TEST_ASSERT_EQUAL_INT64(0, bernstein_from_powers(powers[0], 3, b));
    TEST_ASSERT_EQUAL_INT64(0, bernstein_from_powers(powers[0], 8, b));
}

/* 4 t (1 - t) has its maximum 1 at 1/2, where no coefficient shows it; the bound finds it to 1e-5. */
static void test_bounds_are_tight(void)
{
    const int64_t one = (int64_t)1 << 40;
    const int64_t a[5] = {0, 4 * one, -4 * one, 0, 0};
    int64_t b[5];
    int64_t scale = bernstein_from_powers(a, 4, b);
    int64_t top = scale * one;
    TEST_ASSERT_EQUAL_INT(1, bernstein_within(b, 4, 0, top + top / 100000));
    TEST_ASSERT_EQUAL_INT(0, bernstein_within(b, 4, 0, top - top / 100000));
    TEST_ASSERT_EQUAL_INT(0, bernstein_within(b, 4, 1, top * 2));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_leading_zeros);
    RUN_TEST(test_wide_products);
    RUN_TEST(test_product_q44);
    RUN_TEST(test_divisions);
    RUN_TEST(test_thirds_and_fifths_at_the_corners);
    RUN_TEST(test_shifts);
    RUN_TEST(test_sizes_and_order);
    RUN_TEST(test_exact_products);
    RUN_TEST(test_bernstein_of_a_binomial);
    RUN_TEST(test_bounds_are_tight);
    return UNITY_END();
}
