/* SPDX-License-Identifier: MIT */
/* pdff: one sample of the servo loop PDFF (pseudo-derivative feedback with feedforward), as in section 5 of the paper
 * (docs/validation/paper.md). Called by plant/drive, the axis model, and plant/influence, at the rate of the loop.
 * Pure.
 *
 *     speed_ref = k_pp (x_com - x_act) + k_pf d(x_com)/dt
 *     torque    = k_pv (k_vf speed_ref + k_iv * integral of (speed_ref - speed) - speed)
 *     volts     = torque_to_volts * torque, within +-volts_limit
 *
 * The integral contains the present sample (backward Euler), or contains it only from the next sample on (forward
 * Euler). It does not change while the output is saturated. Error of the sampling: docs/theory/drives.md section 13.
 */
#ifndef HODOGRAPH_PLANT_PDFF_H
#define HODOGRAPH_PLANT_PDFF_H

/* The control law, arranged so that few operations have to wait for the encoder:
 *     volts = volts_per_ref * speed_ref + (volts_per_integral * integral before - volts_per_speed * speed) */
struct pdff {
    double k_pp_rad_s_mm;
    double k_pf_rad_mm;
    double step_s;
    /* V per rad/s: torque_to_volts k_pv (k_vf + k_iv step); forward Euler: without the step */
    double volts_per_ref;
    double volts_per_integral; /* V per rad:   torque_to_volts k_pv k_iv */
    double volts_per_speed;    /* V per rad/s: torque_to_volts k_pv (1 + k_iv step); likewise */
    double volts_limit;
};

/* The inputs of one sample. */
struct pdff_input {
    double command_mm;
    double command_mm_s; /* d(x_com)/dt */
    double position_mm;  /* as the encoder reads it */
    double speed_rad_s;
};

/* One sample: returns the volts for the step that begins; integral_rad is the loop's only state. */
static inline double pdff_step(const struct pdff *pdff, double *integral_rad,
                               const struct pdff_input *in)
{
    const double speed_ref = pdff->k_pp_rad_s_mm * (in->command_mm - in->position_mm) +
                             pdff->k_pf_rad_mm * in->command_mm_s;
    const double early =
        pdff->volts_per_integral * *integral_rad - pdff->volts_per_speed * in->speed_rad_s;
    const double volts = pdff->volts_per_ref * speed_ref + early;
    if (volts > pdff->volts_limit) {
        return pdff->volts_limit;
    }
    if (volts < -pdff->volts_limit) {
        return -pdff->volts_limit;
    }
    *integral_rad += pdff->step_s * (speed_ref - in->speed_rad_s);
    return volts;
}

/* The same with an external feedforward: rad/s added to the speed reference, volts to the output. With both 0 the same
 * bits. */
static inline double pdff_step_offset(const struct pdff *pdff, double *integral_rad,
                                      const struct pdff_input *in, double speed_offset_rad_s,
                                      double volts_offset)
{
    const double speed_ref = pdff->k_pp_rad_s_mm * (in->command_mm - in->position_mm) +
                             pdff->k_pf_rad_mm * in->command_mm_s + speed_offset_rad_s;
    const double early =
        pdff->volts_per_integral * *integral_rad - pdff->volts_per_speed * in->speed_rad_s;
    const double volts = pdff->volts_per_ref * speed_ref + early + volts_offset;
    if (volts > pdff->volts_limit) {
        return pdff->volts_limit;
    }
    if (volts < -pdff->volts_limit) {
        return -pdff->volts_limit;
    }
    *integral_rad += pdff->step_s * (speed_ref - in->speed_rad_s);
    return volts;
}

#endif
