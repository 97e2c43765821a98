/* SPDX-License-Identifier: MIT */
/* Implements plant/drive_config.h (see there): the figures that describe a simulated axis. Used by plant/drive,
 * sim/node, sim/offline and host tools. Pure functions, any thread. */
#include "plant/drive_config.h"

#include <stdbool.h>
#include <stddef.h>

/* Also false for NaN. */
static bool in_range(double value, double above, double most)
{
    return value > above && value <= most;
}

static bool drive_plant_ok(const struct drive_plant *p)
{
    const double most = 1e9;
    return in_range(p->gain_rad_s_v, 0.0, most) && in_range(p->time_constant_s, 0.0, most) &&
           in_range(p->screw_mm_rad, 1e-9, 1e6) && in_range(p->torque_to_volts, 0.0, most) &&
           in_range(p->volts_limit, 0.0, 32.767);
}

static bool drive_gains_ok(const struct drive_pdff *g)
{
    const double gains[] = {g->k_pp_rad_s_mm, g->k_pv_nm_s_rad, g->k_iv_per_s, g->k_pf_rad_mm,
                            g->k_vf};
    for (size_t i = 0; i < sizeof gains / sizeof gains[0]; i++) {
        if (!(gains[i] >= 0.0 && gains[i] <= 1e9)) {
            return false;
        }
    }
    return true;
}

static bool drive_encoder_ok(const struct drive_config *c)
{
    return c->encoder_counts_per_rev >= 1 && c->encoder_counts_per_rev <= (UINT32_C(1) << 28) &&
           c->counts_per_mm >= 1 && c->counts_per_mm <= UINT32_C(1000000000);
}

double drive_config_rated_torque_nm(const struct drive_config *c)
{
    return 0.5 * c->plant.volts_limit / c->plant.torque_to_volts;
}

uint32_t drive_config_samples(const struct drive_config *c)
{
    const uint64_t scaled = (uint64_t)c->loop_rate_hz * c->period_us;
    if (c->period_us < 1 || c->period_us > 1000000 || scaled % 1000000 != 0 ||
        scaled / 1000000 > 65536) {
        return 0;
    }
    return (uint32_t)(scaled / 1000000);
}

int drive_config_check(const struct drive_config *c)
{
    if (!drive_plant_ok(&c->plant)) {
        return DRIVE_ERR_PLANT;
    }
    if (!drive_gains_ok(&c->pdff)) {
        return DRIVE_ERR_GAIN;
    }
    if (!drive_encoder_ok(c)) {
        return DRIVE_ERR_ENCODER;
    }
    if (drive_config_samples(c) == 0) {
        return DRIVE_ERR_RATE;
    }
    if (c->plant.time_constant_s * (double)c->loop_rate_hz < 1.0) {
        return DRIVE_ERR_STEP;
    }
    if (c->interpolation > DRIVE_NO_INTERPOLATION) {
        return DRIVE_ERR_INTERPOLATION;
    }
    if (c->speed > DRIVE_SPEED_DIFFERENCES || c->delay_samples > 1) {
        return DRIVE_ERR_SENSING;
    }
    if (c->integral > DRIVE_INTEGRAL_FORWARD) {
        return DRIVE_ERR_INTEGRAL;
    }
    return 0;
}

const char *drive_error_text(int code)
{
    switch (code) {
    case 0:
        return "no error";
    case DRIVE_ERR_PLANT:
        return "plant figures must be positive numbers and volts_limit at most 32.767 V";
    case DRIVE_ERR_GAIN:
        return "PDFF gains must be finite and not negative";
    case DRIVE_ERR_ENCODER:
        return "encoder counts_per_rev must be 1 to 2^28 and counts_per_mm 1 to 10^9";
    case DRIVE_ERR_RATE:
        return "the period must hold a whole number of servo samples, 1 to 65536 (loop_rate_hz "
               "times period)";
    case DRIVE_ERR_STEP:
        return "the plant's time constant is shorter than one servo sample";
    case DRIVE_ERR_INTERPOLATION:
        return "interpolation must be 0 (linear), 1 (cubic) or 2 (none)";
    case DRIVE_ERR_SENSING:
        return "speed must be 0 (exact) or 1 (differences), delay_samples 0 or 1";
    case DRIVE_ERR_INTEGRAL:
        return "integral must be 0 (backward) or 1 (forward)";
    default:
        return "unknown error";
    }
}
