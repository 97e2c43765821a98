/* SPDX-License-Identifier: MIT */
/* motor: motor and ball screw: a first-order lag from volts to shaft speed, integrated exactly. Used by plant/drive and
 * plant/influence.
 *
 *     speed' = (gain * volts - speed) / time_constant        [rad/s, paper.md section 5, G(s)]
 *     position' = screw * speed                              [mm]
 *
 * Over one step of h seconds with constant volts the solution is linear in the state and in the
 * volts; motor_init computes its coefficients once, by power series (no libm, so they have the same
 * bits everywhere). Derivation: docs/theory/drives.md section 13. Any thread. No I/O: the functions change only the
 * structs that they are given.
 */
#ifndef HODOGRAPH_PLANT_MOTOR_H
#define HODOGRAPH_PLANT_MOTOR_H

#include <float.h>

#if !defined(FLT_EVAL_METHOD) || FLT_EVAL_METHOD != 0
#error "the drive model needs plain double arithmetic (on 32-bit x86: -msse2 -mfpmath=sse)"
#endif

/* Coefficients of one step. */
struct motor {
    double speed_from_speed;    /* exp(-h / T) */
    double speed_from_volts;    /* rad/s per V */
    double position_from_speed; /* mm per rad/s */
    double position_from_volts; /* mm per V */
};

struct motor_state {
    double position_mm;
    double speed_rad_s;
};

/* gain: rad/s per V, more than 0; time_constant_s, more than 0; screw: mm/rad, more than 0; step_s:
 * more than 0 and at most time_constant_s (the caller has checked all this: drive_init does). */
void motor_init(struct motor *motor, double gain_rad_s_v, double time_constant_s,
                double screw_mm_rad, double step_s);

/* One step with the volts held. Inline because a simulated second has tens of thousands of steps.
 */
static inline void motor_step(const struct motor *motor, struct motor_state *state, double volts)
{
    state->position_mm +=
        motor->position_from_speed * state->speed_rad_s + motor->position_from_volts * volts;
    state->speed_rad_s =
        motor->speed_from_speed * state->speed_rad_s + motor->speed_from_volts * volts;
}

#endif
