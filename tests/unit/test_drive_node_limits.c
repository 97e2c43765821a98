/* SPDX-License-Identifier: MIT */
/* What the drive supervises: following error, switches, software limits, overload, supply, encoder, deadlines, short
 * frames; and its objects for scaling, feedforward and actual values. Run by `make unit`; no I/O. */
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "drive_bench.h"
#include "unity.h"

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

static void put(uint16_t index, uint8_t sub, int64_t value)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, drive_bench_write(index, sub, value));
}

static void move(int periods, int32_t counts)
{
    for (int k = 0; k < periods; k++) {
        bench.target += counts;
        drive_bench_run(1);
    }
}

/* Fault reset has no effect while the cause is there; then it helps. */
static void reset(enum cia402_state expected)
{
    bench.word = CIA402_DISABLE_VOLTAGE;
    drive_bench_run(2);
    bench.word = CIA402_FAULT_RESET;
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_INT(expected, state());
}

static void test_following_error(void)
{
    put(0x6065, 0, 100000); /* 0.1 mm; the loop's own lead at 10 mm/s is 0.016 mm */
    put(0x6066, 0, 20);
    drive_bench_enable();
    move(500, 10000);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FREEZE}, true);
    int periods = 0;
    while (state() == CIA402_OPERATION_ENABLED && periods < 100) {
        move(1, 10000);
        periods++;
    }
    TEST_ASSERT_INT_WITHIN(5, 30, periods); /* 10 ms to leave the window, 20 ms of time-out */
    drive_bench_expect_emcy(EMCY_FOLLOWING_ERROR, EMCY_REGISTER_PROFILE | EMCY_REGISTER_GENERIC);
    drive_bench_run(1);
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_FOLLOWING_ERROR) != 0);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FREEZE}, false);
    drive_bench_run(1500);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
    reset(CIA402_SWITCH_ON_DISABLED);
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_FOLLOWING_ERROR);
}

/* In its first period out of the window the error has lasted for one period; the fault comes when it has lasted longer
 * than the time-out. */
static void test_the_time_of_a_following_error_is_exact(void)
{
    put(0x6065, 0, 1000);
    put(0x6066, 0, 20);
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_JUMP, .counts = 50000}, true);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FREEZE}, true);
    drive_bench_run(20);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT_REACTION_ACTIVE, state());
}

/* The time starts again when the error was within the window for a period. */
static void test_the_time_of_a_following_error_starts_again(void)
{
    put(0x6065, 0, 1000);
    put(0x6066, 0, 20);
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FREEZE}, true);
    const int32_t begin = bench.target;
    for (int k = 0; k < 5; k++) {
        bench.target = begin + 2000;
        drive_bench_run(20);
        bench.target = begin;
        drive_bench_run(2);
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    }
}

static void test_a_jump_of_the_encoder(void)
{
    put(0x6065, 0, 100000);
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_JUMP, .counts = 200000}, true);
    drive_bench_run(1);
    TEST_ASSERT_INT32_WITHIN(20, 1200000, drive_bench_position());
    drive_bench_run(1);
    TEST_ASSERT_EQUAL_HEX16(EMCY_FOLLOWING_ERROR, drive_bench_read(0x603F, 0));
}

static void test_an_encoder_that_fails(void)
{
    drive_bench_enable();
    move(300, 50000);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FAULT}, true);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state()); /* nothing to stop with */
    drive_bench_expect_emcy(EMCY_POSITION_SENSOR_1, EMCY_REGISTER_PROFILE | EMCY_REGISTER_GENERIC);
    drive_bench_run(100);
    TEST_ASSERT_TRUE(axis_motion_at_standstill(&bench.node.servo.axis));
    reset(CIA402_FAULT);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FAULT}, false);
    reset(CIA402_SWITCH_ON_DISABLED);
}

/* A restart does not repair it: the drive reports it after its boot-up message, and cannot be enabled. */
static void test_a_cause_that_persists_over_a_restart(void)
{
    const uint16_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION};
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FAULT}, true);
    for (int restart = 0; restart < 2; restart++) {
        if (restart == 0) {
            drive_bench_nmt(NMT_RESET_NODE);
        } else {
            drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_RESTART}, true);
        }
        drive_bench_expect_emcy(EMCY_POSITION_SENSOR_1,
                                EMCY_REGISTER_PROFILE | EMCY_REGISTER_GENERIC);
        drive_bench_nmt(NMT_START);
        for (int k = 0; k < 3; k++) {
            bench.word = words[k];
            drive_bench_run(1);
        }
        TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
    }
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FAULT}, false);
    drive_bench_nmt(NMT_RESET_NODE);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, state());
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE, .volts = 0.4}, true);
    drive_bench_nmt(NMT_RESET_NODE);
    drive_bench_expect_emcy(EMCY_DC_UNDERVOLTAGE, EMCY_REGISTER_VOLTAGE | EMCY_REGISTER_GENERIC);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
}

static void test_undervoltage(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE, .volts = 0.4}, true);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, state());
    drive_bench_expect_emcy(EMCY_DC_UNDERVOLTAGE, EMCY_REGISTER_VOLTAGE | EMCY_REGISTER_GENERIC);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_read(0x6041, 0) & CIA402_STATUS_VOLTAGE);
    reset(CIA402_FAULT);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE}, false);
    reset(CIA402_SWITCH_ON_DISABLED);
    TEST_ASSERT_TRUE((drive_bench_read(0x6041, 0) & CIA402_STATUS_VOLTAGE) != 0);
}

/* Rated torque is half of the greatest; 4.5 V against a load are 1.8 of it: 1.8^2 - 1 a second until
 * (2^2 - 1) * 10 s are full: 13.4 s. */
static void test_overload(void)
{
    put(0x6067, 0, 1000000);
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_LOAD, .volts = 4.5}, true);
    drive_bench_run(2000);
    TEST_ASSERT_INT_WITHIN(5, 1800, (int)drive_bench_read(0x6077, 0));
    TEST_ASSERT_INT_WITHIN(5, 1800, (int)drive_bench_read(0x6078, 0));
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_WARNING);
    drive_bench_run(10000);
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_WARNING) != 0);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    int periods = 12000;
    while (state() == CIA402_OPERATION_ENABLED && periods < 20000) {
        drive_bench_run(1);
        periods++;
    }
    TEST_ASSERT_INT_WITHIN(100, 13400, periods);
    TEST_ASSERT_EQUAL_HEX16(EMCY_OVERLOAD, drive_bench_read(0x603F, 0));
    TEST_ASSERT_EQUAL_HEX8(EMCY_REGISTER_CURRENT | EMCY_REGISTER_GENERIC,
                           drive_bench_read(0x1001, 0));
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_LOAD}, false);
    reset(CIA402_FAULT);
    bench.node.servo.supervision.overload.heat_s = 32.0;
    drive_bench_nmt(NMT_RESET_NODE); /* the motor stays hot */
    drive_bench_nmt(NMT_START);
    drive_bench_run(1);
    drive_bench_expect_emcy(EMCY_OVERLOAD, EMCY_REGISTER_CURRENT | EMCY_REGISTER_GENERIC);
    reset(CIA402_FAULT);
    drive_bench_run(8000); /* cools by 1 s a second, to 80 % of 30 s */
    reset(CIA402_SWITCH_ON_DISABLED);
}

static void test_saturation_is_an_internal_limit(void)
{
    drive_bench_enable();
    move(20, 400000);
    TEST_ASSERT_EQUAL_INT16(5000, drive_bench_volts_mv());
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_LIMIT) != 0);
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_FOLLOWS) != 0);
}

static void test_limit_switch(void)
{
    struct equipment equipment;
    equipment_init(&equipment, &drive_bench_config);
    equipment.limit_positive_mm = 3.0;
    TEST_ASSERT_TRUE(drive_node_equip(&bench.node, &equipment));
    put(0x6085, 0, 500000000);
    drive_bench_enable();
    while (state() == CIA402_OPERATION_ENABLED && bench.target < 10000000) {
        move(1, 50000);
    }
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
    drive_bench_expect_emcy(EMCY_POSITION_LIMIT, EMCY_REGISTER_PROFILE | EMCY_REGISTER_GENERIC);
    TEST_ASSERT_EQUAL_HEX8(2, drive_bench_newest(COB_EMCY)->data[3]);
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_POSITIVE, drive_bench_read(0x60FD, 0));
    const uint16_t bits = CIA402_STATUS_LIMIT | CIA402_STATUS_WARNING;
    TEST_ASSERT_EQUAL_HEX16(bits, drive_bench_read(0x6041, 0) & bits);
    bench.word = CIA402_QUICK_STOP;
    drive_bench_run(300);
    TEST_ASSERT_INT32_WITHIN(200000, 3000000 + 2500000, drive_bench_position());
    drive_bench_enable(); /* away from the switch is permitted, further on it not */
    move(20, -50000);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    move(2, 50000);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
}

static void test_a_switch_that_is_forced(void)
{
    drive_bench_enable();
    drive_bench_fault(
        (struct fault_rule){.kind = FAULT_KIND_LIMIT_SWITCH, .side = FAULT_SIDE_NEGATIVE}, true);
    move(20, 10000);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    move(2, -10000);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
    drive_bench_fault(
        (struct fault_rule){.kind = FAULT_KIND_LIMIT_SWITCH, .side = FAULT_SIDE_NEGATIVE}, false);
    TEST_ASSERT_EQUAL_HEX32(0, drive_bench_read(0x60FD, 0));
}

static void test_software_limits(void)
{
    put(0x607D, 2, 1500000);
    drive_bench_enable();
    move(200, 5000);
    TEST_ASSERT_INT32_WITHIN(20, 1500000, drive_bench_position());
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_LIMIT) != 0);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_FOLLOWS);
    move(200, -5000);
    TEST_ASSERT_EQUAL_HEX16(0, drive_bench_statusword() & CIA402_STATUS_LIMIT);
    TEST_ASSERT_TRUE((drive_bench_statusword() & CIA402_STATUS_FOLLOWS) != 0);
}

static void test_a_short_frame_is_not_processed(void)
{
    struct can_msg frame;
    drive_bench_enable();
    cob_frame(&frame, COB_RPDO1 + DRIVE_BENCH_ID, 5);
    drive_node_receive(&bench.node, &frame);
    drive_bench_expect_emcy(EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION | EMCY_REGISTER_GENERIC);
    drive_bench_sync();
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
}

static void test_short_frames_are_reported_once_until_a_good_one(void)
{
    struct can_msg frame;
    drive_bench_enable();
    cob_frame(&frame, COB_RPDO1 + DRIVE_BENCH_ID, 5);
    drive_node_receive(&bench.node, &frame);
    drive_bench_expect_emcy(EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION | EMCY_REGISTER_GENERIC);
    drive_bench_sync();
    for (int i = 0; i < 5; i++) {
        drive_node_receive(&bench.node, &frame);
    }
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_NULL(drive_bench_newest(COB_EMCY));
    drive_bench_setpoint(bench.word, bench.target);
    drive_bench_expect_emcy(EMCY_NO_ERROR, 0);
    drive_node_receive(&bench.node, &frame);
    drive_bench_expect_emcy(EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION | EMCY_REGISTER_GENERIC);
}

/* Each PDO by itself: what was short has to be well again. */
static void test_a_short_frame_of_another_pdo(void)
{
    struct can_msg brief, whole;
    put(0x1401, 1, 0x300 + DRIVE_BENCH_ID);
    cob_frame(&brief, COB_RPDO2 + DRIVE_BENCH_ID, 3);
    cob_frame(&whole, COB_RPDO2 + DRIVE_BENCH_ID, 4);
    drive_node_receive(&bench.node, &brief);
    drive_bench_expect_emcy(EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION | EMCY_REGISTER_GENERIC);
    drive_bench_sync();
    drive_bench_setpoint(bench.word, bench.target);
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_NULL(drive_bench_newest(COB_EMCY));
    drive_node_receive(&bench.node, &whole);
    drive_bench_expect_emcy(EMCY_NO_ERROR, 0);
}

/* A mapping is changed only while its PDO is off: of all eight. */
static void test_the_mapping_of_a_pdo_that_is_on_stays(void)
{
    static const uint16_t first[] = {0x1400, 0x1800};
    for (unsigned k = 0; k < 2u; k++) {
        for (uint16_t i = 0; i < 4u; i++) {
            const uint16_t index = (uint16_t)(first[k] + i);
            const uint32_t cob = (uint32_t)drive_bench_read(index, 1);
            put(index, 1, cob & 0x7FFFFFFFu);
            TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE,
                                    drive_bench_write((uint16_t)(index + 0x200u), 0, 0));
            put(index, 1, cob | 0x80000000u);
            put((uint16_t)(index + 0x200u), 0, 0);
        }
    }
}

static void test_torque_that_leaves_its_object(void)
{
    drive_bench_enable();
    bench.node.servo.supervision.load_per_volt = 1e9;
    bench.node.servo.axis.drive.state.volts = 1.0;
    TEST_ASSERT_EQUAL_INT64(INT16_MAX, drive_bench_read(0x6077, 0));
    bench.node.servo.axis.drive.state.volts = -1.0;
    TEST_ASSERT_EQUAL_INT64(INT16_MIN, drive_bench_read(0x6077, 0));
}

/* RPDO2 with a controlword alone is no setpoint: the drive that it enables stays where it is. */
static void test_a_controlword_is_no_setpoint(void)
{
    const uint8_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION};
    put(0x1400, 1, 0x80000200 + DRIVE_BENCH_ID);
    put(0x1601, 0, 0);
    put(0x1601, 1, 0x60400010);
    put(0x1601, 0, 1);
    put(0x1401, 2, 255);
    put(0x1401, 1, 0x300 + DRIVE_BENCH_ID);
    put(0x607A, 0, 9000000);
    drive_bench_sync();
    for (int i = 0; i < 3; i++) {
        const struct can_msg frame = {.id = 0x300 + DRIVE_BENCH_ID, .len = 2, .data = {words[i]}};
        drive_node_receive(&bench.node, &frame);
    }
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    TEST_ASSERT_INT32_WITHIN(20, 1000000, bench.node.values.target_position);
    put(0x1401, 1, 0x80000300 + DRIVE_BENCH_ID);
    put(0x1601, 0, 0);
    put(0x1601, 1, 0x607A0020);
    put(0x1601, 0, 1);
    put(0x1401, 1, 0x300 + DRIVE_BENCH_ID);
    const struct can_msg target = {.id = 0x300 + DRIVE_BENCH_ID, .len = 4};
    drive_node_receive(&bench.node, &target);
    TEST_ASSERT_TRUE(bench.node.servo.setpoint_fresh);
}

/* What a TPDO maps is up to date at its SYNC, whatever it is. */
static void test_every_mapped_value_is_up_to_date(void)
{
    drive_bench_enable();
    put(0x1801, 1, 0x80000280 + DRIVE_BENCH_ID);
    put(0x1A01, 0, 0);
    put(0x1A01, 1, 0x60620020);
    put(0x1A01, 0, 1);
    put(0x1801, 1, 0x280 + DRIVE_BENCH_ID);
    for (int k = 0; k < 3; k++) {
        move(1, 1000);
        drive_bench_sync();
        const struct can_msg *frame = drive_bench_newest(COB_TPDO2);
        TEST_ASSERT_NOT_NULL(frame);
        TEST_ASSERT_EQUAL_UINT32(bench.target, cob_get(frame->data, 4));
    }
}

/* SYNC goes on, setpoints do not: 0x1400 sub 5. */
static void test_setpoints_that_stay_away(void)
{
    put(0x1400, 5, 20);
    drive_bench_enable();
    for (int k = 0; k < 20; k++) {
        drive_bench_sync();
        drive_node_process(&bench.node, 1000);
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    }
    drive_bench_sync();
    drive_node_process(&bench.node, 1000);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, state());
    TEST_ASSERT_EQUAL_HEX16(EMCY_RPDO_TIMEOUT, drive_bench_read(0x603F, 0));
}

/* Time that has passed before a setpoint came is no part of its deadline: a process that reads its clock seldom trips
 * no drive that gets its setpoints in time. */
static void test_a_deadline_is_not_early(void)
{
    put(0x1400, 5, 10);
    drive_bench_enable();
    for (int k = 0; k < 20; k++) {
        drive_bench_setpoint(bench.word, bench.target);
        drive_bench_sync();
        drive_node_process(&bench.node, 20000);
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, state());
    }
    drive_node_process(&bench.node, 10001);
    TEST_ASSERT_EQUAL_HEX16(EMCY_RPDO_TIMEOUT, drive_bench_read(0x603F, 0));
}

static void test_scaling(void)
{
    put(0x608F, 1, 1048576);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, drive_bench_write(0x608F, 1, 4096));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, drive_bench_write(0x608F, 2, 2));
    TEST_ASSERT_EQUAL_INT64(9990265, drive_bench_read(0x6092, 1));
    put(0x6092, 1, 9990265); /* what it has: nothing is rounded */
    TEST_ASSERT_TRUE(bench.node.servo.axis.drive.counts_per_mm == 1e6);
    put(0x6092, 1, 99903);
    TEST_ASSERT_INT32_WITHIN(1, 10000, (int32_t)drive_bench_read(0x6064, 0));
    put(0x6091, 1, 2); /* two turns of the motor for one of the shaft: half the counts */
    TEST_ASSERT_INT32_WITHIN(1, 5000, (int32_t)drive_bench_read(0x6064, 0));
    put(0x6091, 2, 2);
    put(0x6092, 1, 9990265);
    TEST_ASSERT_TRUE(bench.node.servo.axis.drive.counts_per_mm == 1e6);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, drive_bench_write(0x6092, 1, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_LOW, drive_bench_write(0x6092, 1, 0));
    drive_bench_enable();
    put(0x6092, 1, 9990265);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, drive_bench_write(0x6092, 1, 5000000));
}

/* A scaled axis moves by its own counts. */
static void test_a_scaled_axis_moves(void)
{
    put(0x6092, 1, 99903);
    drive_bench_enable();
    move(1000, 20);
    drive_bench_run(300);
    TEST_ASSERT_INT32_WITHIN(1, 30000, drive_bench_position());
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 3.0, axis_motion_place_mm(&bench.node.servo.axis));
}

static void test_feedforward_objects(void)
{
    put(0x1400, 1, 0x80000200 + DRIVE_BENCH_ID);
    put(0x1600, 0, 0);
    put(0x1600, 3, 0x60B20010);
    put(0x1600, 0, 3);
    put(0x1400, 1, 0x200 + DRIVE_BENCH_ID);
    put(0x6040, 0, CIA402_SHUTDOWN);
    put(0x6040, 0, CIA402_SWITCH_ON);
    put(0x6040, 0, CIA402_ENABLE_OPERATION);
    put(0x60B1, 0, 1590000); /* 1 rad/s of the screw of 1.59 mm/rad */
    put(0x60B2, 0, 400);     /* of half of 5 V */
    drive_bench_sync();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, bench.node.servo.axis.influence.speed_offset_rad_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, bench.node.servo.axis.influence.volts_offset);
    put(0x60B1, 0, 0);
    put(0x60B2, 0, 0);
    drive_bench_sync();
    TEST_ASSERT_FALSE(
        influence_acts(&bench.node.servo.axis.influence, &bench.node.servo.axis.drive));
    put(0x60B2, 0, 400);
    put(0x6040, 0, CIA402_DISABLE_VOLTAGE);
    drive_bench_sync();
    TEST_ASSERT_FALSE(
        influence_acts(&bench.node.servo.axis.influence, &bench.node.servo.axis.drive));
}

static void test_digital_inputs_on_change(void)
{
    put(0x1802, 1, 0x380 + DRIVE_BENCH_ID);
    drive_bench_run(1);
    TEST_ASSERT_NOT_NULL(drive_bench_newest(0x380));
    drive_bench_run(20);
    TEST_ASSERT_NULL(drive_bench_newest(0x380));
    drive_bench_fault(
        (struct fault_rule){.kind = FAULT_KIND_LIMIT_SWITCH, .side = FAULT_SIDE_POSITIVE}, true);
    drive_bench_run(1);
    TEST_ASSERT_NOT_NULL(drive_bench_newest(0x380));
    TEST_ASSERT_EQUAL_HEX64(EQUIPMENT_INPUT_POSITIVE, cob_get(drive_bench_newest(0x380)->data, 4));
}

/* CiA 301: 0x1019 may change only while 0x1006 is 0. */
static void test_sync_counter(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, drive_bench_write(0x1019, 0, 10));
    put(0x1019, 0, 240);
    put(0x1006, 0, 0);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, drive_bench_write(0x1019, 0, 1));
    put(0x1019, 0, 10);
    for (uint8_t k = 0; k < 20; k++) {
        bench.counter = (uint8_t)(k % 10);
        drive_bench_sync();
    }
    TEST_ASSERT_EQUAL_INT64(0, drive_bench_read(0x2101, OD_DRIVE_SIMULATION_LOST_SYNCS));
    put(0x1006, 0, 2000);
    TEST_ASSERT_EQUAL_UINT32(32, bench.node.servo.axis.drive.samples);
}

static void test_encoder_resolution(void)
{
    struct drive_config config = drive_bench_config;
    config.encoder_counts_per_rev = 4096;
    drive_bench_begin_with(&config);
    TEST_ASSERT_EQUAL_INT64(4096, drive_bench_read(0x608F, 1));
}

static void test_identity_and_ratings(void)
{
    struct equipment equipment;
    equipment_init(&equipment, &drive_bench_config);
    equipment.serial = 4711;
    equipment.rated_torque_nm = 1.5;
    TEST_ASSERT_TRUE(drive_node_equip(&bench.node, &equipment));
    TEST_ASSERT_EQUAL_INT64(4711, drive_bench_read(0x1018, 4));
    TEST_ASSERT_EQUAL_INT64(1500, drive_bench_read(0x6076, 0));
    TEST_ASSERT_EQUAL_INT64(5000, drive_bench_read(0x6075, 0));
    TEST_ASSERT_EQUAL_HEX32(0xA0, drive_bench_read(0x6502, 0));
    equipment.rated_torque_nm = 0.0;
    TEST_ASSERT_FALSE(drive_node_equip(&bench.node, &equipment));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_following_error);
    RUN_TEST(test_the_time_of_a_following_error_is_exact);
    RUN_TEST(test_the_time_of_a_following_error_starts_again);
    RUN_TEST(test_a_jump_of_the_encoder);
    RUN_TEST(test_an_encoder_that_fails);
    RUN_TEST(test_a_cause_that_persists_over_a_restart);
    RUN_TEST(test_undervoltage);
    RUN_TEST(test_overload);
    RUN_TEST(test_saturation_is_an_internal_limit);
    RUN_TEST(test_limit_switch);
    RUN_TEST(test_a_switch_that_is_forced);
    RUN_TEST(test_software_limits);
    RUN_TEST(test_a_short_frame_is_not_processed);
    RUN_TEST(test_short_frames_are_reported_once_until_a_good_one);
    RUN_TEST(test_a_short_frame_of_another_pdo);
    RUN_TEST(test_the_mapping_of_a_pdo_that_is_on_stays);
    RUN_TEST(test_torque_that_leaves_its_object);
    RUN_TEST(test_a_controlword_is_no_setpoint);
    RUN_TEST(test_every_mapped_value_is_up_to_date);
    RUN_TEST(test_setpoints_that_stay_away);
    RUN_TEST(test_a_deadline_is_not_early);
    RUN_TEST(test_scaling);
    RUN_TEST(test_a_scaled_axis_moves);
    RUN_TEST(test_feedforward_objects);
    RUN_TEST(test_digital_inputs_on_change);
    RUN_TEST(test_sync_counter);
    RUN_TEST(test_encoder_resolution);
    RUN_TEST(test_identity_and_ratings);
    return UNITY_END();
}
