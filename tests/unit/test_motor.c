/* SPDX-License-Identifier: MIT */
/* Tests of plant/motor.h: motor and ball screw. Run by `make unit`; no I/O. */
#include "plant/motor.h"

#include <math.h>

#include "unity.h"

static const double GAIN = 83.0089, TIME_CONSTANT = 0.19936, SCREW = 1.59;

void setUp(void)
{
}

void tearDown(void)
{
}

static void near(double expected, double actual, double relative)
{
    TEST_ASSERT_DOUBLE_WITHIN(relative * fabs(expected), expected, actual);
}

static void test_coefficients_agree_with_libm(void)
{
    const double ratios[] = {1e-6, 3.1e-4, 0.01, 0.3, 1.0};
    for (unsigned i = 0; i < sizeof ratios / sizeof ratios[0]; i++) {
        const double h = ratios[i] * TIME_CONSTANT;
        const double rise = -expm1(-ratios[i]);
        struct motor m;
        motor_init(&m, GAIN, TIME_CONSTANT, SCREW, h);
        near(exp(-ratios[i]), m.speed_from_speed, 4e-16);
        near(GAIN * rise, m.speed_from_volts, 1e-15);
        near(SCREW * TIME_CONSTANT * rise, m.position_from_speed, 1e-15);
        /* the closed form cancels: its own error is eps times h over the small result */
        near(SCREW * GAIN * (h - TIME_CONSTANT * rise), m.position_from_volts,
             1e-15 + 1e-15 / ratios[i]);
    }
}

/* Exact integration: many small steps and one large one end in the same state. */
static void test_steps_compose(void)
{
    struct motor small, large;
    struct motor_state a = {1.5, -20.0}, b = {1.5, -20.0};
    motor_init(&small, GAIN, TIME_CONSTANT, SCREW, TIME_CONSTANT / 512.0);
    motor_init(&large, GAIN, TIME_CONSTANT, SCREW, TIME_CONSTANT / 2.0);
    for (int i = 0; i < 256; i++) {
        motor_step(&small, &a, 3.25);
    }
    motor_step(&large, &b, 3.25);
    near(b.position_mm, a.position_mm, 1e-13);
    near(b.speed_rad_s, a.speed_rad_s, 1e-13);
}

static void test_final_speed_is_gain_times_volts(void)
{
    struct motor m;
    struct motor_state s = {0.0, 0.0};
    motor_init(&m, GAIN, TIME_CONSTANT, SCREW, TIME_CONSTANT);
    for (int i = 0; i < 60; i++) {
        motor_step(&m, &s, -2.0);
    }
    near(-2.0 * GAIN, s.speed_rad_s, 1e-14);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_coefficients_agree_with_libm);
    RUN_TEST(test_steps_compose);
    RUN_TEST(test_final_speed_is_gain_times_volts);
    return UNITY_END();
}
