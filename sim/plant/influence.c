/* SPDX-License-Identifier: MIT */
/* Implements plant/influence.h (see there): what acts on an axis in addition to its setpoints: load, friction, faults.
 * Used by sim/node and sim/offline. docs/theory/drives.md section 13. Changes its arguments only; any thread. */
#include "plant/influence.h"

void influence_none(struct influence *influence, const struct drive_config *config)
{
    const struct influence none = {.volts_limit = config->plant.volts_limit};
    *influence = none;
}

/* Something that keeps the axis from resting at its target. */
static bool influence_disturbs(const struct influence *in)
{
    return in->speed_offset_rad_s != 0.0 || in->volts_offset != 0.0 || in->load_volts != 0.0 ||
           in->encoder_offset_mm != 0.0 || in->encoder_frozen;
}

bool influence_acts(const struct influence *in, const struct drive *drive)
{
    return influence_disturbs(in) || in->friction_volts != 0.0 ||
           in->volts_limit != drive->pdff.volts_limit;
}

void influence_offsets(struct influence *in, const struct drive *drive,
                       const struct drive_config *config, int32_t speed_counts_s,
                       int16_t torque_permille, double rated_torque_nm)
{
    const double mm_s = (double)speed_counts_s * drive->mm_per_count;
    const double torque_nm = 0.001 * (double)torque_permille * rated_torque_nm;
    in->speed_offset_rad_s = mm_s / config->plant.screw_mm_rad;
    in->volts_offset = torque_nm * config->plant.torque_to_volts;
}

double influence_read_mm(const struct influence *in, const struct drive *drive)
{
    if (in->encoder_frozen) {
        return in->encoder_frozen_mm;
    }
    return encoder_read_mm(&drive->encoder, drive->state.motor.position_mm) + in->encoder_offset_mm;
}

int32_t influence_read_counts(const struct influence *in, const struct drive *drive)
{
    return encoder_to_i32(influence_read_mm(in, drive) * drive->counts_per_mm);
}

/* Motor, load and dry friction over one sample: friction works against the motion, or holds the axis where it stands.
 * It can stop a motion but not reverse it. */
static void influence_move(const struct motor *motor, struct motor_state *state, double volts,
                           double friction_volts)
{
    const double before = state->speed_rad_s;
    const bool held = volts <= friction_volts && volts >= -friction_volts;
    double net = volts;
    if (before > 0.0 || (before == 0.0 && volts > friction_volts)) {
        net = volts - friction_volts;
    } else if (before < 0.0 || (before == 0.0 && volts < -friction_volts)) {
        net = volts + friction_volts;
    } else {
        net = 0.0;
    }
    motor_step(motor, state, net);
    if (held && ((before > 0.0 && state->speed_rad_s < 0.0) ||
                 (before < 0.0 && state->speed_rad_s > 0.0))) {
        state->speed_rad_s = 0.0;
    }
}

static void influence_push(const struct influence *in, const struct motor *motor,
                           struct motor_state *state, double volts, double friction_volts)
{
    if (friction_volts > 0.0) {
        influence_move(motor, state, volts - in->load_volts, friction_volts);
    } else {
        motor_step(motor, state, volts - in->load_volts);
    }
}

void influence_period(const struct influence *in, struct drive *d, int32_t target_counts)
{
    struct pdff pdff = d->pdff;
    pdff.volts_limit = in->volts_limit;
    if (drive_stays_parked(d, target_counts, !influence_disturbs(in))) {
        return;
    }
    const struct drive_command c = drive_command(d, target_counts);
    for (uint32_t i = 0; i < d->samples; i++) {
        struct pdff_input input;
        drive_command_at(&c, i, &input);
        input.position_mm = influence_read_mm(in, d);
        input.speed_rad_s = drive_speed(d, &d->state, input.position_mm);
        const double computed = pdff_step_offset(&pdff, &d->state.integral_rad, &input,
                                                 in->speed_offset_rad_s, in->volts_offset);
        d->state.volts = drive_volts(d, &d->state, computed);
        influence_push(in, &d->motor, &d->state.motor, d->state.volts, in->friction_volts);
    }
}

bool influence_coast(const struct influence *in, struct drive *d, double brake_volts)
{
    const double friction_volts = brake_volts + in->friction_volts;
    struct motor_state motor = d->state.motor;
    const bool held = in->load_volts <= friction_volts && in->load_volts >= -friction_volts;
    for (uint32_t i = 0; i < d->samples && !(motor.speed_rad_s == 0.0 && held); i++) {
        influence_push(in, &d->motor, &motor, 0.0, friction_volts);
    }
    drive_hold(d);
    d->state.motor = motor;
    d->state.read_mm = influence_read_mm(in, d);
    d->target_counts = influence_read_counts(in, d);
    return motor.speed_rad_s == 0.0 && held;
}

/* Volts against the motion act as friction does, which stops a motion but does not reverse it. */
bool influence_brake(const struct influence *in, struct drive *d, double volts)
{
    const double most = volts < in->volts_limit ? volts : in->volts_limit;
    const bool forward = d->state.motor.speed_rad_s > 0.0;
    const bool rests = influence_coast(in, d, most);
    d->state.volts = rests ? 0.0 : (forward ? -most : most);
    return rests;
}
