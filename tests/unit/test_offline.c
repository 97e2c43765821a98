/* SPDX-License-Identifier: MIT */
/* Tests of offline/offline.h: the whole chain in one process, without a bus. Run by `make unit`; no I/O. */
#include "offline/offline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/counts.h"
#include "drive_bench.h"
#include "unity.h"

enum { TICKS = 1001, SETTLING = 200, ROWS = TICKS + SETTLING };

/* A line of 4 mm in 1 s: F = 4 (10 t^3 - 15 t^4 + 6 t^5). */
static uint8_t
    image[PROGRAM_HEADER_SIZE + PROGRAM_SEGMENT_SIZE + PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE];
static struct program program;
static uint64_t records[(sizeof(struct coefficients_piece) + sizeof(struct coefficients_segment)) /
                        sizeof(uint64_t)];
static struct contour_segment segments[1];
static struct drive_config configs[2];
static struct offline sim;
static struct offline_row rows[ROWS];

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
    piece[72 + 1] = 0x40; /* factor 1.0; then codes of override bounds */
    memset(piece + 74, 128, 2u * PROGRAM_LEVELS);
    memset(&program, 0, sizeof program);
    program.image = image;
    program.size = sizeof image;
    program.header.period_us = 1000;
    program.header.axis_count = PROGRAM_PLANE;
    program.header.header_size = PROGRAM_HEADER_SIZE;
    program.header.segment_count = 1;
    program.header.piece_count = 1;
    program.header.duration_q32_s = UINT64_C(1) << 32;
    program.header.length_q40_mm = 4 * mm;
}

void setUp(void)
{
    configs[0] = configs[1] = drive_bench_config;
    make_program();
    TEST_ASSERT_EQUAL_INT(
        0, coefficients_make_in(&program, kernel_find(KERNEL_FIXED), records, sizeof records));
}

void tearDown(void)
{
}

static int begin(void)
{
    return offline_begin(&sim, &program, configs, segments);
}

static void test_rows_of_a_line(void)
{
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, ROWS));
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
        /* y stays parked: the remainder is the rounding of its encoder and, at the ends, x */
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
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, 7));
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows + 7, ROWS - 7));
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
    TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_DRIVE - 10 + DRIVE_ERR_GAIN, begin());
    configs[0].plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_DRIVE + DRIVE_ERR_PLANT, begin());
    setUp();
    configs[1].period_us = 2000;
    TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_PERIOD, begin());
    setUp();
    configs[1].counts_per_mm = 1000;
    TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_COUNTS, begin());
    setUp();
    program.coefficients_for = NULL;
    TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_COEFFICIENTS, begin());
}

static void test_times_and_points(void)
{
    static uint64_t times[TICKS + 2];
    static struct interpolator_point points[TICKS + 2];
    static int32_t counts[2 * (TICKS + 2)];
    struct interpolator interp;
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, ROWS));
    offline_times(&program, 0, TICKS + 2, times);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(4398046511), times[1]);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 42, times[TICKS - 1]);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1) << 42, times[TICKS + 1]);
    for (int k = 0; k < TICKS / 2; k++) { /* backwards too */
        const uint64_t kept = times[k];
        times[k] = times[TICKS - 1 - k];
        times[TICKS - 1 - k] = kept;
    }
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&interp, &program));
    TEST_ASSERT_EQUAL_INT(0, offline_points(&interp, TICKS, times, 1000000, points, counts));
    for (int k = 0; k < TICKS; k++) {
        TEST_ASSERT_EQUAL_INT64(rows[TICKS - 1 - k].cmd_q40_mm[0], points[k].position_q40[0]);
        TEST_ASSERT_EQUAL_INT32(rows[TICKS - 1 - k].set_counts[0], counts[2 * k]);
        TEST_ASSERT_EQUAL_INT32(rows[TICKS - 1 - k].set_counts[1], counts[2 * k + 1]);
    }
}

static void test_times_do_not_drift_in_long_programs(void)
{
    uint64_t time;
    program.header.duration_q32_s = (UINT64_C(1) << 54) - 1u;
    program.header.period_us = 8000;
    offline_times(&program, 499999999, 1, &time); /* 3 999 999.992 s */
    TEST_ASSERT_EQUAL_UINT64((UINT64_C(3999999) << 42) + UINT64_C(4362862139015), time);
}

/* With what the drive would otherwise have to find out: with the velocity's missing share it follows more closely,
 * and with no gains the bits are the plain ones. */
static void test_feedforward(void)
{
    const struct feedforward_gains none[2] = {{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}};
    struct feedforward_gains gains[2] = {{0, 0, 500, 0, 0}, {0, 0, 500, 0, 0}};
    static struct offline_row forward[ROWS];
    TEST_ASSERT_EQUAL_INT(0, offline_begin(&sim, &program, configs, segments));
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, ROWS));
    TEST_ASSERT_EQUAL_INT(0, offline_begin(&sim, &program, configs, segments));
    offline_feedforward(&sim, none);
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, forward, ROWS));
    for (int k = 0; k < ROWS; k++) {
        TEST_ASSERT_EQUAL_INT32_ARRAY(rows[k].act_counts, forward[k].act_counts, 2);
        TEST_ASSERT_EQUAL_INT16_ARRAY(rows[k].volts_mv, forward[k].volts_mv, 2);
    }
    configs[0].pdff.k_pf_rad_mm = 0.3; /* 0.3 + 0.5 * 1/1.59 is near the 1/1.59 of the screw */
    TEST_ASSERT_EQUAL_INT(0, offline_begin(&sim, &program, configs, segments));
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, ROWS));
    TEST_ASSERT_EQUAL_INT(0, offline_begin(&sim, &program, configs, segments));
    offline_feedforward(&sim, gains);
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, forward, ROWS));
    const int32_t plain = rows[500].set_counts[0] - rows[500].act_counts[0];
    const int32_t better = forward[500].set_counts[0] - forward[500].act_counts[0];
    TEST_ASSERT_TRUE(plain > 10000 && better < plain / 4 && better > -plain / 4);
}

/* Runs with these faults into `faulty`; `rows` has the run without. */
static struct offline_row faulty[ROWS];

static void run_with(const struct offline_fault *faults, uint32_t count)
{
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, rows, ROWS));
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, offline_faults(&sim, faults, count));
    TEST_ASSERT_EQUAL_INT(0, offline_run(&sim, faulty, ROWS));
}

/* The first row that differs in position or volts, ROWS if none does. */
static int first_difference(void)
{
    int k = 0;
    while (k < ROWS && memcmp(rows[k].act_counts, faulty[k].act_counts, 8) == 0 &&
           memcmp(rows[k].volts_mv, faulty[k].volts_mv, 4) == 0) {
        k++;
    }
    return k;
}

/* Of this program setpoint 3 is the first that differs from the start point by a count: tick 0 is
 * the SYNC at which it is latched, and what happens from there on is in row 3. */
enum { TICK_0 = 3 };

static void test_faults_begin_in_their_tick(void)
{
    const struct offline_fault never = {OFFLINE_FAULT_LOAD, 0, ROWS, 1, 2.0};
    struct offline_fault fault = {OFFLINE_FAULT_LOAD, 1, 100, 50, 2.0};
    run_with(&never, 1);
    TEST_ASSERT_EQUAL_INT(ROWS, first_difference());
    run_with(&fault, 1);
    TEST_ASSERT_EQUAL_INT(TICK_0 + 100, first_difference());
    TEST_ASSERT_TRUE(faulty[TICK_0 + 100].act_counts[1] <
                     -1000000); /* a positive load pushes back */
    fault.kind = OFFLINE_FAULT_ENCODER_FREEZE;
    fault.axis = 0;
    run_with(&fault, 1);
    TEST_ASSERT_EQUAL_INT(TICK_0 + 100, first_difference());
    fault.kind = OFFLINE_FAULT_ENCODER_JUMP;
    fault.value = 10000.0;
    run_with(&fault, 1);
    TEST_ASSERT_EQUAL_INT(TICK_0 + 100, first_difference());
    fault.at = 0;
    fault.kind = OFFLINE_FAULT_SATURATE;
    fault.value = 0.05;
    run_with(&fault, 1);
    TEST_ASSERT_TRUE(first_difference() >= TICK_0);
    for (int k = TICK_0; k < TICK_0 + 50; k++) {
        TEST_ASSERT_TRUE(faulty[k].volts_mv[0] <= 50);
    }
}

/* While an encoder reads 10 um too much the axis is 10 um short; afterwards it is where it was. */
static void test_faults_end(void)
{
    const struct offline_fault jump = {OFFLINE_FAULT_ENCODER_JUMP, 1, 100, 600, 10000.0};
    run_with(&jump, 1);
    TEST_ASSERT_INT32_WITHIN(20, -1010000, faulty[TICK_0 + 699].act_counts[1]);
    TEST_ASSERT_INT32_WITHIN(20, -1000000, faulty[ROWS - 1].act_counts[1]);
}

/* What is sent in tick 100 would be latched in tick 101: the drive stays with what it had. */
static void test_setpoints_are_lost(void)
{
    const struct offline_fault lost = {OFFLINE_FAULT_SETPOINT_LOST, 0, 100, 2, 0.0};
    struct drive alone;
    run_with(&lost, 1);
    TEST_ASSERT_EQUAL_INT(0, drive_init(&alone, &configs[0]));
    drive_place(&alone, 10000000);
    for (int k = 0; k < ROWS; k++) {
        const bool missing = k == TICK_0 + 101 || k == TICK_0 + 102;
        drive_period(&alone, rows[missing ? TICK_0 + 100 : k].set_counts[0]);
        TEST_ASSERT_EQUAL_INT32(drive_position_counts(&alone), faulty[k].act_counts[0]);
        TEST_ASSERT_EQUAL_INT32(rows[k].set_counts[0], faulty[k].set_counts[0]);
    }
    TEST_ASSERT_EQUAL_INT(TICK_0 + 101, first_difference());
}

static void test_faults_that_cannot_be(void)
{
    const struct offline_fault good = {OFFLINE_FAULT_SATURATE, 0, 0, 1, 1.0};
    struct offline_fault bad[] = {good, good, good, good, good};
    bad[0].axis = 2;
    bad[1].ticks = 0;
    bad[2].value = 0.0;
    bad[3].value = (double)NAN;
    bad[4].kind = OFFLINE_FAULT_KINDS;
    TEST_ASSERT_EQUAL_INT(0, begin());
    TEST_ASSERT_EQUAL_INT(0, offline_faults(&sim, &good, 1));
    for (int i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_INT(OFFLINE_ERR_FAULT, offline_faults(&sim, &bad[i], 1));
    }
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
    RUN_TEST(test_faults_begin_in_their_tick);
    RUN_TEST(test_faults_end);
    RUN_TEST(test_setpoints_are_lost);
    RUN_TEST(test_faults_that_cannot_be);
    return UNITY_END();
}
