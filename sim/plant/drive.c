/* SPDX-License-Identifier: MIT */
/* Implements plant/drive.h (see there): one simulated servo axis in cyclic synchronous position mode. Called by
 * plant/influence, sim/node, sim/offline and host tools. One thread for each struct drive. Changes only its struct; no
 * I/O. */
#include "plant/drive.h"

static void drive_set_up_loop(struct drive *d, const struct drive_config *c)
{
    const double step_s = 1.0 / (double)c->loop_rate_hz;
    const double volts_s_rad = c->plant.torque_to_volts * c->pdff.k_pv_nm_s_rad;
    d->pdff.k_pp_rad_s_mm = c->pdff.k_pp_rad_s_mm;
    d->pdff.k_pf_rad_mm = c->pdff.k_pf_rad_mm;
    /* The contribution of the present sample to the integral acts in this sample, or from the next one on. */
    const double present =
        c->integral == DRIVE_INTEGRAL_BACKWARD ? c->pdff.k_iv_per_s * step_s : 0.0;
    d->pdff.step_s = step_s;
    d->pdff.volts_per_ref = volts_s_rad * (c->pdff.k_vf + present);
    d->pdff.volts_per_integral = volts_s_rad * c->pdff.k_iv_per_s;
    d->pdff.volts_per_speed = volts_s_rad * (1.0 + present);
    d->pdff.volts_limit = c->plant.volts_limit;
}

int drive_init(struct drive *d, const struct drive_config *c)
{
    const int error = drive_config_check(c);
    if (error != 0) {
        return error;
    }
    drive_set_up_loop(d, c);
    motor_init(&d->motor, c->plant.gain_rad_s_v, c->plant.time_constant_s, c->plant.screw_mm_rad,
               d->pdff.step_s);
    encoder_init(&d->encoder, c->plant.screw_mm_rad, c->encoder_counts_per_rev);
    d->counts_per_mm = (double)c->counts_per_mm;
    d->mm_per_count = 1.0 / d->counts_per_mm;
    d->samples = drive_config_samples(c);
    d->sample_fraction = 1.0 / (double)d->samples;
    d->samples_per_s = (double)c->loop_rate_hz;
    d->cubic = c->interpolation == DRIVE_CUBIC;
    d->steps = c->interpolation == DRIVE_NO_INTERPOLATION;
    d->delayed = c->delay_samples != 0;
    d->speed_per_distance =
        c->speed == DRIVE_SPEED_EXACT ? 0.0 : d->samples_per_s / c->plant.screw_mm_rad;
    d->plain = !d->cubic && !d->delayed && c->speed == DRIVE_SPEED_EXACT;
    drive_place(d, 0);
    return 0;
}

static void drive_rest(struct drive *d)
{
    d->state.motor.speed_rad_s = 0.0;
    d->state.integral_rad = 0.0;
    d->state.volts = 0.0;
    d->state.next_volts = 0.0;
    d->state.read_mm = encoder_read_mm(&d->encoder, d->state.motor.position_mm);
    d->distance_counts = 0.0;
    d->end_distance_counts = 0.0;
}

void drive_place(struct drive *d, int32_t target_counts)
{
    d->state.motor.position_mm = (double)target_counts * d->mm_per_count;
    drive_rest(d);
    d->target_counts = target_counts;
    d->same_target_periods = DRIVE_PARK_PERIODS;
    d->parked = true;
}

void drive_hold(struct drive *d)
{
    drive_rest(d);
    d->target_counts = drive_position_counts(d);
    d->same_target_periods = 0;
    d->parked = false;
}

static bool drive_near_target(const struct drive *d)
{
    const double away_mm = encoder_read_mm(&d->encoder, d->state.motor.position_mm) -
                           (double)d->target_counts * d->mm_per_count;
    const double most_mm = DRIVE_PARK_INCREMENTS * d->encoder.increment_mm;
    return away_mm <= most_mm && away_mm >= -most_mm;
}

bool drive_stays_parked(struct drive *d, int32_t target_counts, bool may_park)
{
    if (target_counts != d->target_counts || !may_park) {
        d->same_target_periods = 0;
        d->parked = false;
        return false;
    }
    if (d->same_target_periods < DRIVE_PARK_PERIODS) {
        d->same_target_periods++;
    }
    if (!d->parked && d->same_target_periods == DRIVE_PARK_PERIODS && drive_near_target(d)) {
        drive_place(d, target_counts);
    }
    return d->parked;
}

/* Cubic from the speed at the end of the last period to that at the end of this one, which is the slope
 * there of the parabola through the last three setpoints. */
static void drive_cubic(struct drive *d, struct drive_command *c, double counts)
{
    const double start = d->end_distance_counts;
    const double end = 1.5 * counts - 0.5 * d->distance_counts;
    c->per_s = d->samples_per_s * d->sample_fraction;
    c->distance_mm[0] = start * d->mm_per_count;
    c->distance_mm[1] = (3.0 * counts - 2.0 * start - end) * d->mm_per_count;
    c->distance_mm[2] = (start + end - 2.0 * counts) * d->mm_per_count;
    d->distance_counts = counts;
    d->end_distance_counts = end;
}

/* The step is one multiplication of the exact difference in counts: a difference of two rounded
 * positions in mm would put noise on the speed feedforward. */
struct drive_command drive_command(struct drive *d, int32_t target_counts)
{
    struct drive_command c = {.cubic = d->cubic, .fraction = d->sample_fraction};
    const double counts = (double)target_counts - (double)d->target_counts;
    c.start_mm = (double)d->target_counts * d->mm_per_count;
    c.step_mm = counts * d->mm_per_count * d->sample_fraction;
    c.speed_mm_s = c.step_mm * d->samples_per_s;
    d->target_counts = target_counts;
    if (d->steps) {
        c.start_mm = (double)target_counts * d->mm_per_count;
        c.step_mm = 0.0;
    }
    if (c.cubic) {
        drive_cubic(d, &c, counts);
    }
    return c;
}

static inline void drive_sample(const struct drive *d, struct drive_state *state,
                                const struct drive_command *c, uint32_t i)
{
    const struct pdff_input in = {
        .command_mm = c->start_mm + (double)i * c->step_mm,
        .command_mm_s = c->speed_mm_s,
        .position_mm = encoder_read_mm(&d->encoder, state->motor.position_mm),
        .speed_rad_s = state->motor.speed_rad_s,
    };
    state->volts = pdff_step(&d->pdff, &state->integral_rad, &in);
    motor_step(&d->motor, &state->motor, state->volts);
}

/* The loops work on copies of the state, which the compiler can keep in registers. */
static void drive_run(struct drive *d, int32_t target_counts)
{
    const struct drive_command c = drive_command(d, target_counts);
    struct drive_state state = d->state;
    for (uint32_t i = 0; i < d->samples; i++) {
        drive_sample(d, &state, &c, i);
    }
    d->state = state;
}

static void drive_run_any(struct drive *d, int32_t target_counts)
{
    const struct drive_command c = drive_command(d, target_counts);
    struct drive_state state = d->state;
    for (uint32_t i = 0; i < d->samples; i++) {
        struct pdff_input in;
        drive_command_at(&c, i, &in);
        in.position_mm = encoder_read_mm(&d->encoder, state.motor.position_mm);
        in.speed_rad_s = drive_speed(d, &state, in.position_mm);
        const double computed = pdff_step(&d->pdff, &state.integral_rad, &in);
        state.volts = drive_volts(d, &state, computed);
        motor_step(&d->motor, &state.motor, state.volts);
    }
    d->state = state;
}

static void drive_run_one(struct drive *d, int32_t target_counts)
{
    if (d->plain) {
        drive_run(d, target_counts);
    } else {
        drive_run_any(d, target_counts);
    }
}

static void drive_run_pair(struct drive *first, struct drive *second,
                           const int32_t target_counts[2])
{
    const struct drive_command c0 = drive_command(first, target_counts[0]);
    const struct drive_command c1 = drive_command(second, target_counts[1]);
    struct drive_state state0 = first->state;
    struct drive_state state1 = second->state;
    for (uint32_t i = 0; i < first->samples; i++) {
        drive_sample(first, &state0, &c0, i);
        drive_sample(second, &state1, &c1, i);
    }
    first->state = state0;
    second->state = state1;
}

void drive_period(struct drive *d, int32_t target_counts)
{
    if (!drive_stays_parked(d, target_counts, true)) {
        drive_run_one(d, target_counts);
    }
}

void drive_period_pair(struct drive *first, struct drive *second, const int32_t target_counts[2])
{
    const bool first_parked = drive_stays_parked(first, target_counts[0], true);
    const bool second_parked = drive_stays_parked(second, target_counts[1], true);
    const bool alike = first->samples == second->samples && first->plain && second->plain;
    if (!first_parked && !second_parked && alike) {
        drive_run_pair(first, second, target_counts);
        return;
    }
    if (!first_parked) {
        drive_run_one(first, target_counts[0]);
    }
    if (!second_parked) {
        drive_run_one(second, target_counts[1]);
    }
}

int32_t drive_position_counts(const struct drive *d)
{
    return encoder_to_i32(encoder_read_mm(&d->encoder, d->state.motor.position_mm) *
                          d->counts_per_mm);
}

int16_t drive_volts_mv(const struct drive *d)
{
    return (int16_t)encoder_to_i32(d->state.volts * 1000.0);
}

bool drive_parked(const struct drive *d)
{
    return d->parked;
}
