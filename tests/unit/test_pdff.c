/* SPDX-License-Identifier: MIT */
/* Tests of plant/pdff.h: PDFF servo loop (pseudo-derivative feedback with feedforward), one sample at a time. Run by
 * `make unit`; no I/O. */
#include "plant/pdff.h"

#include "unity.h"

/* k_pp = 100, k_pf = 0.5, k_vf = 0.8, k_iv = 250, torque_to_volts k_pv = 2, 1 kHz. */
static const struct pdff LOOP = {
    .k_pp_rad_s_mm = 100.0,
    .k_pf_rad_mm = 0.5,
    .step_s = 1e-3,
    .volts_per_ref = 2.0 * (0.8 + 0.25),
    .volts_per_integral = 2.0 * 250.0,
    .volts_per_speed = 2.0 * (1.0 + 0.25),
    .volts_limit = 5.0,
};

void setUp(void)
{
}

void tearDown(void)
{
}

/* By hand: ref = 100 * 0.01 + 0.5 * 2 = 2; integral = 0.001 + 1e-3 (2 - 1.5) = 0.0015;
 * volts = 2 (0.8 * 2 + 250 * 0.0015 - 1.5) = 0.95 */
static void test_one_sample_by_hand(void)
{
    const struct pdff_input in = {1.01, 2.0, 1.0, 1.5};
    double integral = 0.001;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.95, pdff_step(&LOOP, &integral, &in));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0015, integral);
}

static void test_saturates_and_stops_the_integral(void)
{
    const struct pdff_input up = {1.0, 0.0, 0.0, 0.0}, down = {-1.0, 0.0, 0.0, 0.0};
    double integral = 0.125;
    TEST_ASSERT_TRUE(pdff_step(&LOOP, &integral, &up) == 5.0);
    TEST_ASSERT_TRUE(integral == 0.125);
    integral = -0.125;
    TEST_ASSERT_TRUE(pdff_step(&LOOP, &integral, &down) == -5.0);
    TEST_ASSERT_TRUE(integral == -0.125);
}

static void test_at_rest_stays_at_rest(void)
{
    const struct pdff_input in = {3.0, 0.0, 3.0, 0.0};
    double integral = 0.0;
    TEST_ASSERT_TRUE(pdff_step(&LOOP, &integral, &in) == 0.0);
    TEST_ASSERT_TRUE(integral == 0.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_sample_by_hand);
    RUN_TEST(test_saturates_and_stops_the_integral);
    RUN_TEST(test_at_rest_stays_at_rest);
    return UNITY_END();
}
