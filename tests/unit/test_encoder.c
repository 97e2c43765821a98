/* SPDX-License-Identifier: MIT */
/* Tests of plant/encoder.h: encoder on the motor shaft. Run by `make unit`; no I/O. */
#include "plant/encoder.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_round_is_to_nearest_ties_to_even(void)
{
    TEST_ASSERT_TRUE(encoder_round(2.5) == 2.0);
    TEST_ASSERT_TRUE(encoder_round(3.5) == 4.0);
    TEST_ASSERT_TRUE(encoder_round(-2.5) == -2.0);
    TEST_ASSERT_TRUE(encoder_round(-2.51) == -3.0);
    TEST_ASSERT_TRUE(encoder_round(0.49999999999999994) == 0.0);
    TEST_ASSERT_TRUE(encoder_round(2147483647.25) == 2147483647.0);
}

static void test_reading_is_within_half_an_increment(void)
{
    struct encoder e;
    encoder_init(&e, 1.59, 1u << 20);
    /* 2 pi 1.59 / 2^20 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, 9.5274588e-6, e.increment_mm);
    for (int i = -1000; i <= 1000; i++) {
        const double position = 0.7310585 * i;
        TEST_ASSERT_DOUBLE_WITHIN(0.5000001 * e.increment_mm, position,
                                  encoder_read_mm(&e, position));
    }
    TEST_ASSERT_TRUE(encoder_read_mm(&e, 0.499 * e.increment_mm) == 0.0);
    TEST_ASSERT_TRUE(encoder_read_mm(&e, 0.501 * e.increment_mm) == e.increment_mm);
}

static void test_i32_saturates(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, encoder_to_i32(3e9));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, encoder_to_i32(-3e9));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, encoder_to_i32(2147483646.9));
    TEST_ASSERT_EQUAL_INT32(-7, encoder_to_i32(-7.2));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_round_is_to_nearest_ties_to_even);
    RUN_TEST(test_reading_is_within_half_an_increment);
    RUN_TEST(test_i32_saturates);
    return UNITY_END();
}
