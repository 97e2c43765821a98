/* SPDX-License-Identifier: MIT */
/* The drive as a whole through the states of CiA 402-2: commands, option codes, stops of the motor. Run by
 * `make unit`; no I/O. */
#include <math.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "drive_bench.h"
#include "unity.h"

enum { SPEED = 50000 }; /* counts a period: 50 mm/s */

void setUp(void)
{
    drive_bench_begin();
}

void tearDown(void)
{
}

static enum cia402_state state(void)
{
    return bench.node.servo.device.state;
}

static void move(int periods)
{
    for (int k = 0; k < periods; k++) {
        bench.target += SPEED;
        drive_bench_run(1);
    }
}

static void put(uint16_t index, int64_t value)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(index, 0, value));
}

/* Periods until the state is left; the distance of the axis meanwhile in counts. */
static int32_t way;
static int leave(enum cia402_state from)
{
    const int32_t begin = axis_motion_position(&bench.node.servo.axis);
    int periods = 0;
    while (state() == from && periods < 2000) {
        drive_bench_run(1);
        periods++;
    }
    way = axis_motion_position(&bench.node.servo.axis) - begin;
    return periods;
}

/* Brings a standing drive into a state of the standard. */
static void bring(enum cia402_state to)
{
    drive_bench_begin();
    if (to == CIA402_FAULT) {
        drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x1000}, true);
        return;
    }
    const uint16_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION};
    for (int k = 0; k < (int)to - CIA402_SWITCH_ON_DISABLED && k < 3; k++) {
        put(0x6040, words[k]);
    }
    if (to == CIA402_QUICK_STOP_ACTIVE) {
        put(0x605A, 6);
        put(0x6040, CIA402_QUICK_STOP);
    }
    TEST_ASSERT_EQUAL_INT(to, state());
}

/* CiA 402-2, the table of transitions: rows are states from Switch on disabled to Quick stop active
 * (0x605A = 6) and Fault, columns the commands. */
static void test_every_command_in_every_state(void)
{
    static const uint16_t commands[] = {CIA402_DISABLE_VOLTAGE,  CIA402_QUICK_STOP,
                                        CIA402_SHUTDOWN,         CIA402_SWITCH_ON,
                                        CIA402_ENABLE_OPERATION, CIA402_FAULT_RESET};
    enum {
        D = CIA402_SWITCH_ON_DISABLED,
        R = CIA402_READY_TO_SWITCH_ON,
        S = CIA402_SWITCHED_ON,
        E = CIA402_OPERATION_ENABLED,
        Q = CIA402_QUICK_STOP_ACTIVE,
        F = CIA402_FAULT
    };
    static const struct {
        int from;
        int to[6];
    } rows[] = {
        {D, {D, D, R, D, D, D}}, {R, {D, D, R, S, S, D}}, {S, {D, D, R, S, E, D}},
        {E, {D, Q, R, S, E, D}}, {Q, {D, Q, Q, Q, E, D}}, {F, {F, F, F, F, F, D}},
    };
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        for (unsigned c = 0; c < 6; c++) {
            bring((enum cia402_state)rows[i].from);
            put(0x605A, 6);
            put(0x605C, 0);
            put(0x6040, commands[c]);
            TEST_ASSERT_EQUAL_INT(rows[i].to[c], state());
            TEST_ASSERT_EQUAL_HEX16(cia402_status_bits(state()),
                                    drive_bench_read(0x6041, 0) & 0x6F);
        }
    }
}

/* 0x605A: where the drive ends, and by which ramp (0x6084 gentle, 0x6085 hard). */
static void test_quick_stop_codes(void)
{
    static const struct {
        int16_t code;
        enum cia402_state end;
        int32_t way; /* v^2 / 2a */
    } rows[] = {
        {0, CIA402_SWITCH_ON_DISABLED, 0},       {1, CIA402_SWITCH_ON_DISABLED, 12500000},
        {2, CIA402_SWITCH_ON_DISABLED, 1250000}, {5, CIA402_QUICK_STOP_ACTIVE, 12500000},
        {6, CIA402_QUICK_STOP_ACTIVE, 1250000},
    };
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        drive_bench_begin();
        put(0x605A, rows[i].code);
        put(0x6084, 100000000);
        put(0x6085, 1000000000);
        drive_bench_enable();
        move(400);
        bench.word = CIA402_QUICK_STOP;
        drive_bench_run(1);
        if (rows[i].code == 0) {
            TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
            continue;
        }
        TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
        TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_TARGET_REACHED);
        const int32_t from = axis_motion_position(&bench.node.servo.axis);
        drive_bench_run(700);
        TEST_ASSERT_EQUAL_INT(rows[i].end, state());
        TEST_ASSERT_INT32_WITHIN(rows[i].way / 10 + 150000, rows[i].way,
                                 axis_motion_position(&bench.node.servo.axis) - from);
        if (rows[i].code >= 5) {
            TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_TARGET_REACHED) != 0);
            bench.target = axis_motion_position(&bench.node.servo.axis);
            bench.word = CIA402_ENABLE_OPERATION; /* transition 16 */
            drive_bench_run(1);
            TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
        }
    }
}

/* Braking distance of a motor from `speed` mm/s with constant volts, mm: the solution of its equation
 * (plant/motor.h). */
static double braking_way_mm(double speed_mm_s, double volts)
{
    const struct drive_plant *plant = &drive_bench_config.plant;
    const double speed_rad_s = speed_mm_s / plant->screw_mm_rad;
    const double end_rad_s = plant->gain_rad_s_v * volts; /* where it would go to */
    const double time_s = plant->time_constant_s * log(1.0 + speed_rad_s / end_rad_s);
    return plant->screw_mm_rad * (plant->time_constant_s * speed_rad_s - end_rad_s * time_s);
}

/* 0x605A = 3, 4 and 7, 8: at the limit of the current, of the voltage; by the motor's own law, and it is held there. */
static void test_quick_stop_at_the_motors_limits(void)
{
    static const struct {
        double volts;
        enum cia402_state end;
        int16_t code;
    } rows[] = {
        {2.5, CIA402_SWITCH_ON_DISABLED, 3},
        {5.0, CIA402_SWITCH_ON_DISABLED, 4},
        {2.5, CIA402_QUICK_STOP_ACTIVE, 7},
        {5.0, CIA402_QUICK_STOP_ACTIVE, 8},
    };
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        drive_bench_begin();
        put(0x605A, rows[i].code);
        drive_bench_enable();
        move(400);
        const double speed_mm_s = (double)axis_motion_speed(&bench.node.servo.axis) * 1e-6;
        const int32_t from = axis_motion_position(&bench.node.servo.axis);
        bench.word = CIA402_QUICK_STOP;
        drive_bench_run(1);
        TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
        TEST_ASSERT_INT_WITHIN(1, (int)(-1000.0 * rows[i].volts),
                               drive_volts_mv(&bench.node.servo.axis.drive));
        drive_bench_run(1500);
        const double way_mm = (double)(axis_motion_position(&bench.node.servo.axis) - from) * 1e-6;
        /* half a servo sample at speed, and the encoder's increment */
        TEST_ASSERT_DOUBLE_WITHIN(0.005, braking_way_mm(speed_mm_s, rows[i].volts), way_mm);
        TEST_ASSERT_EQUAL_INT(rows[i].end, state());
        TEST_ASSERT_EQUAL_INT32(0, axis_motion_speed(&bench.node.servo.axis));
    }
}

/* A second stop brakes again. */
static void test_a_quick_stop_that_stays_can_be_left_and_repeated(void)
{
    drive_bench_begin();
    put(0x605A, 8);
    drive_bench_enable();
    for (int k = 0; k < 2; k++) {
        move(300);
        bench.word = CIA402_QUICK_STOP;
        drive_bench_run(1);
        TEST_ASSERT_INT_WITHIN(1, -5000, drive_volts_mv(&bench.node.servo.axis.drive));
        drive_bench_run(1500);
        TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_TARGET_REACHED) != 0);
        bench.target = axis_motion_position(&bench.node.servo.axis);
        bench.word = CIA402_ENABLE_OPERATION;
        drive_bench_run(1);
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    }
}

static void test_codes_that_do_not_exist(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, drive_bench_write(0x605A, 0, 9));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_LOW, drive_bench_write(0x605A, 0, -1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, drive_bench_write(0x605B, 0, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, drive_bench_write(0x605C, 0, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, drive_bench_write(0x605E, 0, 5));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, drive_bench_write(0x6007, 0, 4));
}

/* 0x605B (shutdown), 0x605C (disable operation): at once, or after the ramp 0x6084. */
static void test_leaving_operation_enabled(void)
{
    static const struct {
        uint16_t object;
        uint16_t command;
        enum cia402_state end;
    } rows[] = {{0x605B, CIA402_SHUTDOWN, CIA402_READY_TO_SWITCH_ON},
                {0x605C, CIA402_SWITCH_ON, CIA402_SWITCHED_ON}};
    for (unsigned i = 0; i < 2; i++) {
        for (int16_t code = 0; code <= 1; code++) {
            drive_bench_begin();
            put(0x6084, 500000000);
            put(rows[i].object, code);
            drive_bench_enable();
            move(200);
            bench.word = rows[i].command;
            const int periods = leave(CIA402_OPERATION_ENABLED);
            TEST_ASSERT_EQUAL_INT(rows[i].end, state());
            TEST_ASSERT_TRUE(code == 0 ? periods == 1 : periods > 100 && periods < 140);
        }
    }
}

/* Enabling again calls a slow stop off. */
static void test_a_stop_called_off(void)
{
    drive_bench_enable();
    move(200);
    bench.word = CIA402_SWITCH_ON;
    drive_bench_run(10);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    bench.target = bench.node.servo.axis.target_counts;
    bench.word = CIA402_ENABLE_OPERATION;
    drive_bench_run(300);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    TEST_ASSERT_INT32_WITHIN(100, bench.target, drive_bench_position());
}

static void test_fault_reaction_codes(void)
{
    for (int16_t code = 0; code <= 2; code++) {
        drive_bench_begin();
        put(0x605E, code);
        put(0x6084, 100000000);
        put(0x6085, 1000000000);
        drive_bench_enable();
        move(200);
        drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x6100}, true);
        TEST_ASSERT_EQUAL_INT(code == 0 ? CIA402_FAULT : CIA402_FAULT_REACTION_ACTIVE, state());
        (void)leave(CIA402_FAULT_REACTION_ACTIVE);
        TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
        const int32_t expected = code == 0 ? 0 : (code == 1 ? 12500000 : 1250000);
        TEST_ASSERT_INT32_WITHIN(expected / 10 + 150000, expected, way);
        TEST_ASSERT_EQUAL_HEX16(0x6100, drive_bench_read(0x603F, 0));
    }
}

/* The motor is slower than its reference: the stop ends with the motor, not with the reference. */
static void test_a_stop_ends_when_the_motor_stands(void)
{
    put(0x6085, 2000000000);
    drive_bench_enable();
    move(400);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE, .volts = 0.9}, true);
    bench.word = CIA402_QUICK_STOP;
    const int reference = 25; /* periods of the ramp: 50 mm/s by 2000 mm/s^2 */
    drive_bench_run(reference + 10);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
    TEST_ASSERT_EQUAL_INT64(0, bench.node.servo.axis.speed_counts_period);
    TEST_ASSERT_FALSE(axis_motion_at_standstill(&bench.node.servo.axis));
    (void)leave(CIA402_QUICK_STOP_ACTIVE);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    TEST_ASSERT_INT32_WITHIN(1000000, 0, axis_motion_speed(&bench.node.servo.axis));
}

/* After a second the brake has to stop a motor that never stands. */
static void test_patience_ends(void)
{
    put(0x605A, 6);
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE, .volts = 0.9}, true);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_LOAD, .volts = 3.0}, true);
    put(0x605A, 2);
    bench.word = CIA402_QUICK_STOP;
    TEST_ASSERT_INT_WITHIN(5, 1002,
                           leave(CIA402_OPERATION_ENABLED) + leave(CIA402_QUICK_STOP_ACTIVE));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
}

static void test_power_off_is_the_brake(void)
{
    drive_bench_enable();
    move(400);
    bench.word = CIA402_DISABLE_VOLTAGE;
    const int32_t from = axis_motion_position(&bench.node.servo.axis);
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    drive_bench_run(50);
    TEST_ASSERT_TRUE(axis_motion_at_standstill(&bench.node.servo.axis));
    TEST_ASSERT_INT32_WITHIN(150000, 360000, axis_motion_position(&bench.node.servo.axis) - from);
}

/* A drive that restarts at speed is configured while its axis still coasts. */
static void test_configuring_does_not_stop_a_coasting_axis(void)
{
    struct equipment equipment;
    equipment_init(&equipment, &drive_bench_config);
    equipment.brake_volts = 0.1;
    TEST_ASSERT_TRUE(drive_node_equip(&bench.node, &equipment));
    const double scale = bench.node.servo.axis.drive.counts_per_mm;
    put(0x6040, CIA402_SHUTDOWN);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x6092, 1, 2000000));
    TEST_ASSERT_TRUE(bench.node.servo.axis.drive.counts_per_mm != scale);
    drive_bench_enable();
    move(400);
    drive_bench_nmt(NMT_RESET_NODE); /* the scale is that of the drive again */
    const double speed = bench.node.servo.axis.drive.state.motor.speed_rad_s;
    TEST_ASSERT_TRUE(speed > 10.0 && bench.node.servo.axis.drive.counts_per_mm == scale);
    const double place_mm = bench.node.servo.axis.drive.state.motor.position_mm;
    put(0x1006, 2000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x60C2, 1, 1));
    TEST_ASSERT_TRUE(bench.node.servo.axis.drive.state.motor.speed_rad_s == speed);
    TEST_ASSERT_TRUE(bench.node.servo.axis.drive.state.motor.position_mm == place_mm);
    drive_bench_sync();
    TEST_ASSERT_FALSE(axis_motion_at_standstill(&bench.node.servo.axis));
}

/* Option codes are those of the moment of the error, also without a controlword since. */
static void test_an_option_code_written_after_the_controlword(void)
{
    drive_bench_enable();
    put(0x605E, 0);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x4210}, true);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
    drive_bench_begin();
    drive_bench_enable();
    put(0x605A, 0);
    for (int i = 0; i < 60; i++) {
        drive_node_process(&bench.node, 10000); /* no SYNC */
    }
    TEST_ASSERT_EQUAL_HEX16(EMCY_SYNC_LOST, bench.node.values.error_code);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
}

static void test_reset_reports_no_error(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x4210}, true);
    drive_bench_run(50);
    bench.word = CIA402_FAULT_RESET;
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    TEST_ASSERT_NOT_NULL(drive_bench_newest(COB_EMCY));
    TEST_ASSERT_EQUAL_HEX64(0, cob_get(drive_bench_newest(COB_EMCY)->data, 3));
    TEST_ASSERT_EQUAL_HEX64(0, drive_bench_read(0x603F, 0));
    TEST_ASSERT_EQUAL_HEX64(0, drive_bench_read(0x1001, 0));
    TEST_ASSERT_EQUAL_INT64(1, drive_bench_read(0x1003, 0));
    TEST_ASSERT_EQUAL_HEX64(0x4210, drive_bench_read(0x1003, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x1003, 0, 0));
    TEST_ASSERT_EQUAL_INT64(0, drive_bench_read(0x1003, 0));
}

/* 0x6007: what the loss of the connection does. */
static void test_abort_connection_codes(void)
{
    static const enum cia402_state after[] = {CIA402_OPERATION_ENABLED,
                                              CIA402_FAULT_REACTION_ACTIVE,
                                              CIA402_SWITCH_ON_DISABLED, CIA402_QUICK_STOP_ACTIVE};
    for (int16_t code = 0; code <= 3; code++) {
        drive_bench_begin();
        put(0x6007, code);
        drive_bench_enable();
        move(50);
        for (int i = 0; i < 60 && bench.node.values.error_code == 0; i++) {
            drive_node_process(&bench.node, 10000); /* no SYNC */
        }
        TEST_ASSERT_EQUAL_INT(after[code], state());
        TEST_ASSERT_EQUAL_HEX16(EMCY_SYNC_LOST, drive_bench_read(0x603F, 0));
    }
}

/* 0x1016 and 0x1029: the master's heartbeat. */
static void test_error_behaviour(void)
{
    static const enum nmt_state after[] = {NMT_PRE_OPERATIONAL, NMT_OPERATIONAL, NMT_STOPPED};
    for (uint8_t code = 0; code <= 2; code++) {
        struct can_msg beat;
        drive_bench_begin();
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x1029, 1, code));
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x1016, 1, 0x00010064));
        drive_bench_enable();
        move(50);
        cob_frame(&beat, COB_HEARTBEAT + 1, 1);
        beat.data[0] = NMT_OPERATIONAL;
        drive_node_receive(&bench.node, &beat);
        for (int k = 0; k < 120 && state() == CIA402_OPERATION_ENABLED; k++) {
            move(1);
        }
        TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
        TEST_ASSERT_EQUAL_HEX8(after[code], bench.node.nmt.state);
        TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, bench.node.values.error_code);
        (void)leave(CIA402_QUICK_STOP_ACTIVE); /* time passes in each NMT state */
        TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    }
}

/* A heartbeat just before time passes for the node: what has passed before it does not count. Never early, one nap
 * late. */
static void test_the_masters_heartbeat_is_not_missed_early(void)
{
    struct can_msg beat;
    drive_bench_begin();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(0x1016, 1, 0x00010064));
    cob_frame(&beat, COB_HEARTBEAT + 1, 1);
    beat.data[0] = NMT_OPERATIONAL;
    for (int k = 0; k < 3; k++) {
        drive_node_receive(&bench.node, &beat);
        drive_node_process(&bench.node, 10000);
        for (int nap = 0; nap < 10; nap++) {
            drive_node_process(&bench.node, 10000);
            TEST_ASSERT_EQUAL_INT(HEARTBEAT_PRESENT, bench.node.master.presence);
        }
    }
    drive_node_process(&bench.node, 1);
    TEST_ASSERT_EQUAL_INT(HEARTBEAT_MISSING, bench.node.master.presence);
}

/* Enabled by SDO in CSP with no SYNC at all: stands, and after the time of 0x2101 sub 6 the reaction
 * of 0x6007. */
static void test_csp_without_sync(void)
{
    put(0x6040, CIA402_SHUTDOWN);
    put(0x6040, CIA402_SWITCH_ON);
    for (int k = 0; k < 100; k++) {
        drive_node_process(&bench.node, 10000);
    }
    put(0x6040, CIA402_ENABLE_OPERATION);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    for (int k = 0; k < 50; k++) {
        drive_node_process(&bench.node, 10000);
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    }
    drive_node_process(&bench.node, 10000);
    TEST_ASSERT_EQUAL_HEX16(EMCY_SYNC_LOST, drive_bench_read(0x603F, 0));
    for (int k = 0; k < 10; k++) {
        drive_node_process(&bench.node, 10000);
    }
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    put(0x6040, CIA402_SHUTDOWN); /* and again */
    put(0x6040, CIA402_SWITCH_ON);
    put(0x6040, CIA402_ENABLE_OPERATION);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_read(0x603F, 0));
}

/* Mode 0: enabled, it holds its position and says that it does not follow, until it is given a mode. */
static void test_no_mode_at_power_on(void)
{
    drive_bench_nmt(NMT_RESET_NODE);
    drive_bench_nmt(NMT_START);
    TEST_ASSERT_EQUAL_INT64(0, drive_bench_read(0x6060, 0));
    TEST_ASSERT_EQUAL_INT64(0, drive_bench_read(0x6061, 0));
    drive_bench_enable();
    const int32_t place = drive_bench_position();
    bench.target += 1000;
    drive_bench_run(20);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_FOLLOWS);
    TEST_ASSERT_INT_WITHIN(10, place, drive_bench_position());
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_write(0x6060, 0, CIA402_MODE_CSP));
    drive_bench_run(500);
    TEST_ASSERT_EQUAL_HEX16(CIA402_STATUS_FOLLOWS,
                            drive_bench_statusword() & CIA402_STATUS_FOLLOWS);
    TEST_ASSERT_INT_WITHIN(10, place + 1000, drive_bench_position());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_command_in_every_state);
    RUN_TEST(test_quick_stop_codes);
    RUN_TEST(test_quick_stop_at_the_motors_limits);
    RUN_TEST(test_a_quick_stop_that_stays_can_be_left_and_repeated);
    RUN_TEST(test_codes_that_do_not_exist);
    RUN_TEST(test_leaving_operation_enabled);
    RUN_TEST(test_a_stop_called_off);
    RUN_TEST(test_fault_reaction_codes);
    RUN_TEST(test_a_stop_ends_when_the_motor_stands);
    RUN_TEST(test_patience_ends);
    RUN_TEST(test_power_off_is_the_brake);
    RUN_TEST(test_configuring_does_not_stop_a_coasting_axis);
    RUN_TEST(test_an_option_code_written_after_the_controlword);
    RUN_TEST(test_reset_reports_no_error);
    RUN_TEST(test_abort_connection_codes);
    RUN_TEST(test_error_behaviour);
    RUN_TEST(test_the_masters_heartbeat_is_not_missed_early);
    RUN_TEST(test_csp_without_sync);
    RUN_TEST(test_no_mode_at_power_on);
    return UNITY_END();
}
