/* SPDX-License-Identifier: MIT */
/* drive_config: the configuration of a simulated axis: plant, gains, encoder, rates; and its check. Used by
 * plant/drive, sim/node, sim/offline and host tools. Pure functions, any thread. */
#ifndef HODOGRAPH_PLANT_DRIVE_CONFIG_H
#define HODOGRAPH_PLANT_DRIVE_CONFIG_H

#include <stdint.h>

struct drive_plant {
    double gain_rad_s_v;    /* more than 0 */
    double time_constant_s; /* at least one servo step */
    double screw_mm_rad;    /* more than 0 */
    double torque_to_volts; /* V/(N m), more than 0 */
    double volts_limit;     /* more than 0, at most 32.767 (the bus has volts as i16 in mV) */
};

struct drive_pdff {
    double k_pp_rad_s_mm; /* all gains: 0 or more */
    double k_pv_nm_s_rad;
    double k_iv_per_s;
    double k_pf_rad_mm;
    double k_vf;
};

/* How the drive goes from one setpoint to the next (docs/theory/drives.md section 13): in a straight line, along a
 * cubic, or not at all: the setpoint is the command from the beginning of its period. */
enum drive_interpolation {
    DRIVE_LINEAR = 0,           /* in a straight line */
    DRIVE_CUBIC = 1,            /* along a cubic */
    DRIVE_NO_INTERPOLATION = 2, /* at once */
};

/* Source of the speed for the loop: the motor itself, or the difference of the last two encoder samples. */
enum drive_speed {
    DRIVE_SPEED_EXACT = 0,       /* of the motor */
    DRIVE_SPEED_DIFFERENCES = 1, /* of encoder samples */
};

/* Which errors of the speed the loop's integral counts: those of all samples with the present one (backward Euler), or
 * without it (forward Euler). */
enum drive_integral { DRIVE_INTEGRAL_BACKWARD = 0, DRIVE_INTEGRAL_FORWARD = 1 };

struct drive_config {
    struct drive_plant plant;
    struct drive_pdff pdff;
    uint32_t encoder_counts_per_rev; /* 1 ... 2^28 */
    uint32_t loop_rate_hz;           /* servo samples a second; a whole number of them per period */
    uint32_t counts_per_mm;          /* of the bus, 1 ... 10^9 */
    uint32_t period_us;              /* 1 ... 10^6 */
    uint32_t interpolation;          /* enum drive_interpolation */
    uint32_t speed;                  /* enum drive_speed */
    uint32_t delay_samples;          /* 0 or 1: servo samples from reading the encoder to volts */
    uint32_t integral;               /* enum drive_integral */
};

enum drive_error {
    DRIVE_ERR_PLANT = -1,   /* a plant figure is not a number or out of its range */
    DRIVE_ERR_GAIN = -2,    /* a gain is negative or not finite */
    DRIVE_ERR_ENCODER = -3, /* encoder_counts_per_rev or counts_per_mm out of range */
    DRIVE_ERR_RATE = -4, /* no whole number of servo samples per period, or too many (over 65536) */
    DRIVE_ERR_STEP = -5, /* the time constant is shorter than one servo sample */
    DRIVE_ERR_INTERPOLATION = -6, /* no enum drive_interpolation */
    DRIVE_ERR_SENSING = -7,       /* no enum drive_speed, or a delay of more than one sample */
    DRIVE_ERR_INTEGRAL = -8,      /* no enum drive_integral */
};

/* 0, or the first enum drive_error that applies. */
int drive_config_check(const struct drive_config *config);

/* Rated torque of a motor for which none is given: half of what the voltage limit gives, N m. */
double drive_config_rated_torque_nm(const struct drive_config *config);

/* Servo samples per period; 0 when they are no whole number or too many. */
uint32_t drive_config_samples(const struct drive_config *config);

/* One clear English phrase for an enum drive_error; never NULL. */
const char *drive_error_text(int code);

#endif
