/* SPDX-License-Identifier: MIT */
/* Implements plant/motor.h (see there): motor and ball screw. Used by plant/drive and plant/influence. Pure, any
 * context. */
#include "plant/motor.h"

#include <assert.h>

/* 1/k! - z/(k+1)! + z^2/(k+2)! - ...  (the function called phi_k(-z) in exponential integrators),
 * for 0 <= z <= 1. With 20 terms the first one left out is below 1/20!, far under the rounding of a
 * double. */
static double motor_phi(int k, double z)
{
    enum { TERMS = 20 };
    double first = 1.0;
    for (int i = 2; i <= k; i++) {
        first /= i;
    }
    double sum = 1.0;
    for (int i = TERMS; i >= 1; i--) {
        sum = 1.0 - z / (double)(k + i) * sum;
    }
    return first * sum;
}

void motor_init(struct motor *motor, double gain_rad_s_v, double time_constant_s,
                double screw_mm_rad, double step_s)
{
    const double z = step_s / time_constant_s;
    assert(z > 0.0 && z <= 1.0);
    motor->speed_from_speed = motor_phi(0, z);
    motor->speed_from_volts = gain_rad_s_v * z * motor_phi(1, z);
    motor->position_from_speed = screw_mm_rad * step_s * motor_phi(1, z);
    motor->position_from_volts = screw_mm_rad * step_s * gain_rad_s_v * z * motor_phi(2, z);
}
