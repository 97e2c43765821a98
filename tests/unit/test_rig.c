/* SPDX-License-Identifier: MIT */
#include "rig/rig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/counts.h"
#include "unity.h"

enum { TICKS = 1001, SETTLING = 200, ROWS = TICKS + SETTLING };

/* A line of 4 mm in 1 s: F = 4 (10 t^3 - 15 t^4 + 6 t^5). */
static uint8_t image[PROGRAM_HEADER_SIZE + PROGRAM_SEGMENT_SIZE + PROGRAM_PIECE_SIZE];
static struct program program;
static struct contour_segment segments[1];
static struct drive_config configs[2];
static struct rig rig;
static struct rig_row rows[ROWS];

static void put(uint8_t *at, int64_t value)
{
    for (int b = 0; b < 8; b++) {
        at[b] = (uint8_t)((uint64_t)value >> (8 * b));
    }
}

static void make_program(void)
{
    const int64_t mm = INT64_C(1) << 40, w = INT64_C(1) << 44;
    uint8_t *segment = image + PROGRAM_HEADER_SIZE, *piece = segment + PROGRAM_SEGMENT_SIZE;
    memset(image, 0, sizeof image);
    put(segment + 8, 10 * mm);
    put(segment + 16, -1 * mm);
    for (int k = 0; k < 3; k++) {
        put(segment + 24 + 16 * k, 2 * w);
    }
    put(piece, INT64_C(1) << 32);
    put(piece + 16 + 8 * 2, 40 * mm);
    put(piece + 16 + 8 * 3, -60 * mm);
    put(piece + 16 + 8 * 4, 24 * mm);
    piece[72 + 3] = 1; /* factor 1.0 */
    piece[76 + 2] = 1;
    piece[80 + 1] = 1;
    memset(&program, 0, sizeof program);
    program.image = image;
    program.size = sizeof image;
    program.header.period_us = 1000;
    program.header.segment_count = 1;
    program.header.piece_count = 1;
    program.header.duration_q32_s = UINT64_C(1) << 32;
    program.header.length_q40_mm = 4 * mm;
}

void setUp(void)
{
    const struct drive_config axis = {
        .plant = {83.0089, 0.19936, 1.59, 1.0 / 0.716, 5.0},
        .pdff = {97.38, 1.19, 252.8, 0.8, 0.85},
        .encoder_counts_per_rev = 1u << 20,
        .loop_rate_hz = 16000,
        .counts_per_mm = 1000000,
        .period_us = 1000,
    };
    configs[0] = configs[1] = axis;
    make_program();
}

void tearDown(void)
{
}

static int begin(void)
{
    return rig_begin(&rig, &program, INTERP_FIXED, configs, segments);
}

static void test_rows_of_a_line(void)
{
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows, ROWS));
    for (int k = 0; k < ROWS; k++) {
        const double t = k < 1000 ? k * 1e-3 : 1.0;
        const double s = 4 * t * t * t * (10 - 15 * t + 6 * t * t);
        TEST_ASSERT_EQUAL_UINT32(k, rows[k].tick);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, s, (double)rows[k].arc_length_q40_mm / 1099511627776.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, 120 * t * t * (1 - t) * (1 - t),
                                  (double)rows[k].feed_q32_mm_s / 4294967296.0);
        TEST_ASSERT_INT32_WITHIN(1, 10000000 + lrint(1e6 * s), rows[k].set_counts[0]);
        TEST_ASSERT_EQUAL_INT32(-1000000, rows[k].set_counts[1]);
        TEST_ASSERT_EQUAL_INT32(counts_from_q40_mm(rows[k].cmd_q40_mm[0], 1000000),
                                rows[k].set_counts[0]);
        /* y stays parked: what is left is the rounding of its encoder and, at the ends, x */
        TEST_ASSERT_EQUAL_INT16(0, rows[k].volts_mv[1]);
        TEST_ASSERT_INT32_WITHIN(5, -1000000, rows[k].act_counts[1]);
        TEST_ASSERT_TRUE(rows[k].contour_error_um >= 0.0 && rows[k].contour_error_um < 0.6);
    }
    TEST_ASSERT_EQUAL_INT32(14000000, rows[TICKS - 1].set_counts[0]);
    TEST_ASSERT_INT32_WITHIN(100, 14000000, rows[ROWS - 1].act_counts[0]);
}

/* Row k is what the drive reports for SYNC k+2: one period after it has latched setpoint k. */
static void test_positions_are_those_of_the_drive_alone(void)
{
    struct drive alone;
    TEST_ASSERT_EQUAL_INT(0, drive_init(&alone, &configs[0]));
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows, 7));
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows + 7, ROWS - 7));
    drive_place(&alone, 10000000);
    for (int k = 0; k < ROWS; k++) {
        drive_period(&alone, rows[k].set_counts[0]);
        TEST_ASSERT_EQUAL_INT32(drive_position_counts(&alone), rows[k].act_counts[0]);
        TEST_ASSERT_EQUAL_INT16(drive_volts_mv(&alone), rows[k].volts_mv[0]);
    }
}

static void test_faulty_set_up_is_refused(void)
{
    configs[1].pdff.k_vf = -1.0;
    TEST_ASSERT_EQUAL_INT(RIG_ERR_DRIVE - 10 + DRIVE_ERR_GAIN, begin());
    configs[0].plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_EQUAL_INT(RIG_ERR_DRIVE + DRIVE_ERR_PLANT, begin());
    setUp();
    configs[1].period_us = 2000;
    TEST_ASSERT_EQUAL_INT(RIG_ERR_PERIOD, begin());
    setUp();
    configs[1].counts_per_mm = 1000;
    TEST_ASSERT_EQUAL_INT(RIG_ERR_COUNTS, begin());
    setUp();
    TEST_ASSERT_EQUAL_INT(RIG_ERR_KERNEL,
                          rig_begin(&rig, &program, (enum interp_kernel)3, configs, segments));
}

static void test_times_and_points(void)
{
    static uint64_t times[TICKS + 2];
    static struct interp_point points[TICKS + 2];
    static int32_t counts[2 * (TICKS + 2)];
    struct interp interp;
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows, ROWS));
    rig_times(&program, 0, TICKS + 2, times);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(4398046511), times[1]);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 42, times[TICKS - 1]);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 42, times[TICKS + 1]);
    for (int k = 0; k < TICKS / 2; k++) { /* backwards too */
        const uint64_t kept = times[k];
        times[k] = times[TICKS - 1 - k];
        times[TICKS - 1 - k] = kept;
    }
    TEST_ASSERT_EQUAL_INT(0, interp_begin(&interp, &program, INTERP_FIXED));
    TEST_ASSERT_EQUAL_INT(0, rig_points(&interp, TICKS, times, 1000000, points, counts));
    for (int k = 0; k < TICKS; k++) {
        TEST_ASSERT_EQUAL_INT64(rows[TICKS - 1 - k].cmd_q40_mm[0], points[k].x_q40_mm);
        TEST_ASSERT_EQUAL_INT32(rows[TICKS - 1 - k].set_counts[0], counts[2 * k]);
        TEST_ASSERT_EQUAL_INT32(rows[TICKS - 1 - k].set_counts[1], counts[2 * k + 1]);
    }
}

static void test_times_do_not_drift_in_long_programs(void)
{
    uint64_t time;
    program.header.duration_q32_s = (UINT64_C(1) << 54) - 1u;
    program.header.period_us = 8000;
    rig_times(&program, 499999999, 1, &time); /* 3 999 999.992 s */
    TEST_ASSERT_EQUAL_UINT64((UINT64_C(3999999) << 42) + UINT64_C(4362862139015), time);
}

/* The drive is told what it would have to find out: with the velocity's missing share it follows more closely,
 * and with no gains the bits are the plain ones. */
static void test_feedforward(void)
{
    const struct feedforward_gains none[2] = {{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}};
    struct feedforward_gains gains[2] = {{0, 0, 500, 0, 0}, {0, 0, 500, 0, 0}};
    static struct rig_row forward[ROWS];
    TEST_ASSERT_EQUAL_INT(0, rig_begin(&rig, &program, INTERP_FIXED, configs, segments));
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows, ROWS));
    TEST_ASSERT_EQUAL_INT(0, rig_begin(&rig, &program, INTERP_FIXED, configs, segments));
    rig_feedforward(&rig, none);
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, forward, ROWS));
    for (int k = 0; k < ROWS; k++) {
        TEST_ASSERT_EQUAL_INT32_ARRAY(rows[k].act_counts, forward[k].act_counts, 2);
        TEST_ASSERT_EQUAL_INT16_ARRAY(rows[k].volts_mv, forward[k].volts_mv, 2);
    }
    configs[0].pdff.k_pf_rad_mm = 0.3; /* 0.3 + 0.5 * 1/1.59 is near the 1/1.59 of the screw */
    TEST_ASSERT_EQUAL_INT(0, rig_begin(&rig, &program, INTERP_FIXED, configs, segments));
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, rows, ROWS));
    TEST_ASSERT_EQUAL_INT(0, rig_begin(&rig, &program, INTERP_FIXED, configs, segments));
    rig_feedforward(&rig, gains);
    TEST_ASSERT_EQUAL_INT(0, rig_run(&rig, forward, ROWS));
    const int32_t plain = rows[500].set_counts[0] - rows[500].act_counts[0];
    const int32_t better = forward[500].set_counts[0] - forward[500].act_counts[0];
    TEST_ASSERT_TRUE(plain > 10000 && better < plain / 4 && better > -plain / 4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rows_of_a_line);
    RUN_TEST(test_positions_are_those_of_the_drive_alone);
    RUN_TEST(test_faulty_set_up_is_refused);
    RUN_TEST(test_times_and_points);
    RUN_TEST(test_times_do_not_drift_in_long_programs);
    RUN_TEST(test_feedforward);
    return UNITY_END();
}
