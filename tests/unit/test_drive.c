/* SPDX-License-Identifier: MIT */
/* Tests of plant/drive.h: one simulated servo axis in cyclic synchronous position mode. Run by `make unit`; no I/O. */
#include "plant/drive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "drive_bench.h"
#include "offline/axis_run.h"
#include "unity.h"

enum { TICKS = 400 };

static struct drive_config config;

void setUp(void)
{
    config = drive_bench_config;
}

void tearDown(void)
{
}

static struct drive made(void)
{
    struct drive d;
    TEST_ASSERT_EQUAL_INT(0, drive_init(&d, &config));
    return d;
}

/* A smooth start to 100 mm/s on a circle of 8 mm radius, one coordinate of it. */
static int32_t target_at(int k)
{
    const double t = k * 1e-3, u = t / 0.1;
    const double s =
        u < 1.0 ? 10.0 * u * u * u * u * (2.5 - 3.0 * u + u * u) : 5.0 + 100.0 * (t - 0.1);
    return (int32_t)lrint(8e6 * sin(s / 8.0));
}

/* The continuous loop of paper.md section 5 between the same setpoints: Runge and Kutta, 2.5 us. */
struct flow {
    double position_mm, speed_rad_s, integral_rad;
};

static struct flow flow_rate(struct flow y, double command_mm, double command_mm_s)
{
    const struct drive_plant *p = &config.plant;
    const struct drive_pdff *g = &config.pdff;
    const double ref =
        g->k_pp_rad_s_mm * (command_mm - y.position_mm) + g->k_pf_rad_mm * command_mm_s;
    const double torque =
        g->k_pv_nm_s_rad * (g->k_vf * ref + g->k_iv_per_s * y.integral_rad - y.speed_rad_s);
    const double volts = fmin(fmax(p->torque_to_volts * torque, -p->volts_limit), p->volts_limit);
    const struct flow rate = {p->screw_mm_rad * y.speed_rad_s,
                              (p->gain_rad_s_v * volts - y.speed_rad_s) / p->time_constant_s,
                              ref - y.speed_rad_s};
    return rate;
}

static struct flow flow_add(struct flow y, struct flow rate, double h)
{
    const struct flow sum = {y.position_mm + h * rate.position_mm,
                             y.speed_rad_s + h * rate.speed_rad_s,
                             y.integral_rad + h * rate.integral_rad};
    return sum;
}

static struct flow flow_period(struct flow y, double from_mm, double to_mm)
{
    enum { STEPS = 400 };
    const double h = 1e-3 / STEPS, v = (to_mm - from_mm) / 1e-3;
    for (int i = 0; i < STEPS; i++) {
        const double x = from_mm + v * h * i;
        const struct flow k1 = flow_rate(y, x, v);
        const struct flow k2 = flow_rate(flow_add(y, k1, h / 2), x + v * h / 2, v);
        const struct flow k3 = flow_rate(flow_add(y, k2, h / 2), x + v * h / 2, v);
        const struct flow k4 = flow_rate(flow_add(y, k3, h), x + v * h, v);
        y = flow_add(y, k1, h / 6);
        y = flow_add(y, k2, h / 3);
        y = flow_add(y, k3, h / 3);
        y = flow_add(y, k4, h / 6);
    }
    return y;
}

/* Largest distance of the sampled drive from the continuous loop, um. */
static double sampling_error_um(uint32_t loop_rate_hz)
{
    config.loop_rate_hz = loop_rate_hz;
    struct drive d = made();
    struct flow y = {0.0, 0.0, 0.0};
    double worst = 0.0;
    for (int k = 1; k < TICKS; k++) {
        y = flow_period(y, target_at(k - 1) * 1e-6, target_at(k) * 1e-6);
        drive_period(&d, target_at(k));
        worst = fmax(worst, fabs(drive_position_counts(&d) * 1e-6 - y.position_mm));
    }
    return worst * 1e3;
}

/* First order in the servo sample, as a zero-order hold must be; the figures stand in drives.md
 * section 13. */
static void test_sampling_converges_to_the_continuous_loop(void)
{
    const double coarse = sampling_error_um(8000), usual = sampling_error_um(16000);
    const double fine = sampling_error_um(64000);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.46, usual);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, coarse / usual);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 4.0, usual / fine);
}

/* A drive of the figures of drive_bench together with one of `config`, in either order. */
static void check_pair(void)
{
    struct drive b = made();
    setUp();
    struct drive a = made(), c = a, d = b, e = a, f = b;
    for (int k = 0; k < TICKS; k++) {
        const int32_t targets[2] = {target_at(k), k < 50 ? 0 : -target_at(k)};
        const int32_t turned[2] = {targets[1], targets[0]};
        drive_period(&a, targets[0]);
        drive_period(&b, targets[1]);
        drive_period_pair(&c, &d, targets);
        drive_period_pair(&f, &e, turned);
        TEST_ASSERT_EQUAL_MEMORY(&a.state, &c.state, sizeof a.state);
        TEST_ASSERT_EQUAL_MEMORY(&b.state, &d.state, sizeof b.state);
        TEST_ASSERT_EQUAL_MEMORY(&a.state, &e.state, sizeof a.state);
        TEST_ASSERT_EQUAL_MEMORY(&b.state, &f.state, sizeof b.state);
    }
}

static void test_pair_gives_the_bits_of_single_drives(void)
{
    config.pdff.k_pv_nm_s_rad = 1.53;
    check_pair();
    config.loop_rate_hz = 8000;
    check_pair();
    config.delay_samples = 1;
    check_pair();
    config.interpolation = DRIVE_CUBIC;
    check_pair();
}

/* The run of one axis is that of a drive by itself, and an axis with friction lags behind it. */
static void test_an_axis_run_is_that_of_the_drive(void)
{
    static int32_t targets[TICKS], speeds[TICKS];
    static int16_t torques[TICKS];
    double position_mm[TICKS], volts[TICKS];
    struct drive d = made();
    for (int k = 0; k < TICKS; k++) {
        targets[k] = 1000 + target_at(k);
    }
    struct axis_run run = {.target_counts = targets,
                           .speed_counts_s = speeds,
                           .torque_permille = torques,
                           .count = TICKS,
                           .start_counts = 1000,
                           .rated_torque_nm = 1.0};
    TEST_ASSERT_EQUAL_INT(0, axis_run(&config, &run, position_mm, volts));
    drive_place(&d, 1000);
    for (int k = 0; k < TICKS; k++) {
        drive_period(&d, targets[k]);
        TEST_ASSERT_TRUE(d.state.motor.position_mm == position_mm[k]);
        TEST_ASSERT_TRUE(d.state.volts == volts[k]);
    }
    run.friction_volts = 0.3;
    double slowed_mm[TICKS];
    TEST_ASSERT_EQUAL_INT(0, axis_run(&config, &run, slowed_mm, volts));
    TEST_ASSERT_TRUE(slowed_mm[60] < position_mm[60]);
    config.plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_PLANT, axis_run(&config, &run, position_mm, volts));
}

static void test_parked_drive_does_not_move(void)
{
    struct drive d = made();
    drive_place(&d, -1234567);
    const int32_t position = drive_position_counts(&d);
    for (int k = 0; k < 1000; k++) {
        drive_period(&d, -1234567);
        TEST_ASSERT_TRUE(drive_parked(&d));
        TEST_ASSERT_EQUAL_INT32(position, drive_position_counts(&d));
        TEST_ASSERT_EQUAL_INT16(0, drive_volts_mv(&d));
    }
    TEST_ASSERT_INT32_WITHIN(5, -1234567, position);
}

/* After any motion a parked axis has the state of one placed there. */
static void test_parks_after_250_periods_in_the_same_state(void)
{
    struct drive d = made(), placed = made();
    drive_place(&placed, 5000000);
    for (int k = 0; k <= 1000; k++) {
        drive_period(&d, 5000 * k);
    }
    for (int k = 1; k < DRIVE_PARK_PERIODS; k++) {
        drive_period(&d, 5000000);
        TEST_ASSERT_FALSE(drive_parked(&d));
    }
    drive_period(&d, 5000000);
    TEST_ASSERT_TRUE(drive_parked(&d));
    for (int k = 0; k < 50; k++) {
        drive_period(&d, 5000000 + 1000 * k);
        drive_period(&placed, 5000000 + 1000 * k);
        TEST_ASSERT_TRUE(d.state.motor.position_mm == placed.state.motor.position_mm);
        TEST_ASSERT_TRUE(d.state.volts == placed.state.volts);
    }
}

static void test_held_drive_starts_from_where_it_is(void)
{
    struct drive d = made();
    for (int k = 0; k < 200; k++) {
        drive_period(&d, target_at(k));
    }
    drive_hold(&d);
    const int32_t position = drive_position_counts(&d);
    TEST_ASSERT_EQUAL_INT16(0, drive_volts_mv(&d));
    for (int k = 0; k < 300; k++) {
        drive_period(&d, position);
        TEST_ASSERT_INT32_WITHIN(20, position, drive_position_counts(&d));
    }
    TEST_ASSERT_TRUE(drive_parked(&d));
}

/* FNV-1a over the low 32 bits of a number. */
static uint32_t mixed(uint32_t hash, int64_t number)
{
    for (int b = 0; b < 4; b++) {
        hash = (hash ^ (uint32_t)((uint64_t)number >> (8 * b) & 0xFFu)) * 16777619u;
    }
    return hash;
}

/* The same bits with every compiler, level of optimisation and machine: a figure found once with gcc -O2 on x86-64. */
static void test_bits_are_the_same_everywhere(void)
{
    struct drive d = made();
    uint32_t hash = 2166136261u;
    int32_t target = 0;
    for (int k = 0; k < 5000; k++) {
        target += 60000 - abs(k % 4000 - 2000) * 60;
        drive_period(&d, k < 4900 ? target : 4000000);
        hash = mixed(mixed(hash, drive_position_counts(&d)), drive_volts_mv(&d));
    }
    TEST_ASSERT_EQUAL_HEX32(0x83A8BF63u, hash);
}

static void test_volts_saturate_on_a_jump(void)
{
    struct drive d = made();
    drive_period(&d, 1000000);
    TEST_ASSERT_EQUAL_INT16(5000, drive_volts_mv(&d));
    for (int k = 0; k < 700; k++) {
        drive_period(&d, 1000000);
    }
    TEST_ASSERT_INT32_WITHIN(20, 1000000, drive_position_counts(&d));
}

/* Still moving after 250 periods of one target: not parked, from either side. */
static void test_far_from_the_target_is_not_parked(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        struct drive d = made();
        for (int k = 0; k <= DRIVE_PARK_PERIODS + 20; k++) {
            drive_period(&d, sign * 300000000);
            TEST_ASSERT_FALSE(drive_parked(&d));
        }
        TEST_ASSERT_TRUE(abs(drive_position_counts(&d)) < 250000000);
        for (int k = 0; k < 1500; k++) { /* with an overshoot: the volts are saturated */
            drive_period(&d, sign * 300000000);
        }
        TEST_ASSERT_TRUE(drive_parked(&d));
    }
}

/* The cubic begins at a setpoint and ends at the next, with a speed that has no jump and, on a parabola, is
 * the parabola's. */
static void test_cubic_interpolation_has_no_jumps(void)
{
    config.interpolation = DRIVE_CUBIC;
    struct drive d = made();
    struct pdff_input at = {0}, end = {0};
    for (int k = 1; k < TICKS; k++) {
        const int32_t target = k < 50 ? target_at(k) : 40 * (k - 50) * (k - 50) + target_at(49);
        const struct drive_command c = drive_command(&d, target);
        drive_command_at(&c, 0, &at);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, k == 1 ? 0.0 : end.command_mm, at.command_mm);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, end.command_mm_s, at.command_mm_s);
        drive_command_at(&c, d.samples, &end);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, target * 1e-6, end.command_mm);
        if (k > 52) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2e-3 * 40 * (k - 50), end.command_mm_s);
        }
    }
}

/* Largest following error at a SYNC, um. */
static double following_um(void)
{
    struct drive d = made();
    double worst = 0.0;
    for (int k = 1; k < TICKS; k++) {
        drive_period(&d, target_at(k));
        worst = fmax(worst, fabs((target_at(k) - drive_position_counts(&d)) * 1e-3));
    }
    return worst;
}

/* With the velocity feedforward of a screw of 1.59 mm/rad, a stiff loop that receives the speed without steps errs
 * only by what the acceleration needs. */
static void test_cubic_interpolation_follows_more_closely(void)
{
    config.pdff = (struct drive_pdff){250.0, 6.0, 400.0, 1.0 / 1.59, 1.0};
    const double linear_um = following_um();
    config.interpolation = DRIVE_CUBIC;
    const double cubic_um = following_um();
    TEST_ASSERT_TRUE(linear_um > 0.5 && linear_um < 5.0);
    TEST_ASSERT_TRUE(cubic_um < linear_um / 3.0 && cubic_um > 0.01);
}

/* Speed by differences is the mean of the last sample: at constant acceleration half a sample late. A delay puts
 * out what the sample before computed. */
static void test_speed_by_differences_and_delay(void)
{
    config.encoder_counts_per_rev = 1u << 28;
    config.speed = DRIVE_SPEED_DIFFERENCES;
    config.delay_samples = 1;
    struct drive d = made();
    struct drive_state state = d.state;
    const double h = 1.0 / 16000.0, acceleration = 1000.0;
    for (int i = 0; i < 100; i++) {
        const double t = i * h;
        const double read_mm = 0.5 * acceleration * t * t * 1.59;
        const double seen = drive_speed(&d, &state, read_mm);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, i == 0 ? 0.0 : acceleration * (t - h / 2), seen);
        TEST_ASSERT_TRUE(drive_volts(&d, &state, i) == (i == 0 ? 0.0 : i - 1.0));
    }
}

/* The paper's loop is slow compared with a sample: the motion is nearly the same, but its bits differ. */
static void test_sensing_changes_little(void)
{
    struct drive plain = made();
    config.speed = DRIVE_SPEED_DIFFERENCES;
    struct drive differences = made();
    config.delay_samples = 1;
    struct drive both = made();
    double least = 1e9, most = 0.0;
    for (int k = 1; k < TICKS; k++) {
        drive_period(&plain, target_at(k));
        drive_period(&differences, target_at(k));
        drive_period(&both, target_at(k));
        const double at_mm = plain.state.motor.position_mm;
        const double one_mm = fabs(differences.state.motor.position_mm - at_mm);
        const double two_mm = fabs(both.state.motor.position_mm - at_mm);
        most = fmax(most, fmax(one_mm, two_mm));
        least = k == 200 ? fmin(one_mm, fabs(one_mm - two_mm)) : least;
    }
    TEST_ASSERT_TRUE(least > 1e-7 && most > 1e-4 && most < 5e-3);
}

static int init_error(void)
{
    struct drive d;
    const int error = drive_init(&d, &config);
    TEST_ASSERT_TRUE(strlen(drive_error_text(error)) > 5);
    setUp();
    return error;
}

static void test_bad_figures_are_refused(void)
{
    config.plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_PLANT, init_error());
    config.plant.time_constant_s = (double)NAN;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_PLANT, init_error());
    config.plant.volts_limit = 33.0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_PLANT, init_error());
    config.pdff.k_vf = -0.1;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_GAIN, init_error());
    config.pdff.k_iv_per_s = (double)INFINITY;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_GAIN, init_error());
    config.encoder_counts_per_rev = 0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_ENCODER, init_error());
    config.encoder_counts_per_rev = (UINT32_C(1) << 28) + 1u;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_ENCODER, init_error());
    config.encoder_counts_per_rev = UINT32_C(1) << 28;
    TEST_ASSERT_EQUAL_INT(0, init_error());
    config.counts_per_mm = 0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_ENCODER, init_error());
    config.counts_per_mm = 1000000001u;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_ENCODER, init_error());
    config.loop_rate_hz = 16001;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_RATE, init_error());
    config.loop_rate_hz = 0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_RATE, init_error());
    config.plant.time_constant_s = 5e-5;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_STEP, init_error());
    config.interpolation = 3;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_INTERPOLATION, init_error());
    config.integral = 2;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_INTEGRAL, init_error());
    config.speed = 2;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_SENSING, init_error());
    config.delay_samples = 2;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_SENSING, init_error());
    TEST_ASSERT_EQUAL_INT(0, init_error());
}

/* The law of a loop of 1 ms without interpolation, whose integral counts a sample from the next one on: written out. */
static void test_no_interpolation_and_forward_integral(void)
{
    config.loop_rate_hz = 1000;
    config.interpolation = DRIVE_NO_INTERPOLATION;
    config.integral = DRIVE_INTEGRAL_FORWARD;
    const struct drive_pdff *g = &config.pdff;
    struct drive d = made();
    double integral_rad = 0.0, before_mm = 0.0;
    for (int k = 1; k < TICKS; k++) {
        const double command_mm = target_at(k) * 1e-6;
        const double position_mm = encoder_read_mm(&d.encoder, d.state.motor.position_mm);
        const double speed_rad_s = d.state.motor.speed_rad_s;
        const double ref = g->k_pp_rad_s_mm * (command_mm - position_mm) +
                           g->k_pf_rad_mm * (command_mm - before_mm) / 1e-3;
        const double torque =
            g->k_pv_nm_s_rad * (g->k_vf * ref + g->k_iv_per_s * integral_rad - speed_rad_s);
        const double volts = config.plant.torque_to_volts * torque;
        const double most = config.plant.volts_limit;
        const bool saturated = volts > most || volts < -most;
        drive_period(&d, target_at(k));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, fmin(fmax(volts, -most), most), d.state.volts);
        integral_rad += saturated ? 0.0 : (ref - speed_rad_s) * 1e-3;
        before_mm = command_mm;
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sampling_converges_to_the_continuous_loop);
    RUN_TEST(test_pair_gives_the_bits_of_single_drives);
    RUN_TEST(test_an_axis_run_is_that_of_the_drive);
    RUN_TEST(test_parked_drive_does_not_move);
    RUN_TEST(test_parks_after_250_periods_in_the_same_state);
    RUN_TEST(test_held_drive_starts_from_where_it_is);
    RUN_TEST(test_bits_are_the_same_everywhere);
    RUN_TEST(test_volts_saturate_on_a_jump);
    RUN_TEST(test_far_from_the_target_is_not_parked);
    RUN_TEST(test_cubic_interpolation_has_no_jumps);
    RUN_TEST(test_cubic_interpolation_follows_more_closely);
    RUN_TEST(test_speed_by_differences_and_delay);
    RUN_TEST(test_sensing_changes_little);
    RUN_TEST(test_no_interpolation_and_forward_integral);
    RUN_TEST(test_bad_figures_are_refused);
    return UNITY_END();
}
