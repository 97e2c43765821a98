/* SPDX-License-Identifier: MIT */
/* Tests of node/drive_node.h: one simulated servo drive on the bus. Run by `make unit`; no I/O. */
#include "node/drive_node.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "canopen/sdo_abort.h"
#include "drive_bench.h"
#include "unity.h"

enum { ID = 3, SENT_MAX = 64 };

static struct drive_node node;
static struct can_msg sent[SENT_MAX];
static int sent_count;
static uint8_t counter;

static void take(void *context, const struct can_msg *frame)
{
    (void)context;
    TEST_ASSERT_LESS_THAN_INT(SENT_MAX, sent_count);
    sent[sent_count++] = *frame;
}

/* The newest frame with this identifier; NULL: none. */
static const struct can_msg *newest(uint32_t id)
{
    for (int i = sent_count - 1; i >= 0; i--) {
        if (sent[i].id == id) {
            return &sent[i];
        }
    }
    return NULL;
}

static void nmt(enum nmt_command command)
{
    struct can_msg frame;
    nmt_master_command(command, 0, &frame);
    drive_node_receive(&node, &frame);
    drive_node_process(&node, 0);
}

static void sync_number(uint8_t number)
{
    struct can_msg frame;
    cob_frame(&frame, COB_SYNC, 1);
    frame.data[0] = number;
    sent_count = 0;
    drive_node_receive(&node, &frame);
}

/* The next SYNC; the report that came with it. */
static struct pdo_actual sync(void)
{
    struct pdo_actual actual = {0, 0};
    counter = (uint8_t)(counter % 240 + 1);
    sync_number(counter);
    TEST_ASSERT_EQUAL_INT(2, sent_count);
    TEST_ASSERT_EQUAL_INT(ID, pdo_decode_actual(&sent[0], &actual));
    return actual;
}

static int16_t volts(void)
{
    int16_t volts_mv = 0;
    TEST_ASSERT_EQUAL_INT(ID, pdo_decode_volts(&sent[1], &volts_mv));
    return volts_mv;
}

static void setpoint(uint16_t controlword, int32_t target)
{
    const struct pdo_setpoint values = {target, controlword};
    struct can_msg frame;
    pdo_encode_setpoint(ID, &values, &frame);
    drive_node_receive(&node, &frame);
}

static void write_object(uint16_t index, uint8_t sub, uint64_t value, uint32_t size)
{
    uint8_t bytes[8];
    cob_put(bytes, value, size);
    TEST_ASSERT_EQUAL_HEX32(0, od_write(&node.od, od_find(&node.od, index, sub), bytes, size));
}

static uint32_t refusal(uint16_t index, uint8_t sub, uint64_t value, uint32_t size)
{
    uint8_t bytes[8];
    cob_put(bytes, value, size);
    return od_write(&node.od, od_find(&node.od, index, sub), bytes, size);
}

static uint64_t read_object(uint16_t index, uint8_t sub)
{
    uint8_t bytes[8];
    uint32_t size = 0;
    TEST_ASSERT_EQUAL_HEX32(
        0, od_read(&node.od, od_find(&node.od, index, sub), bytes, sizeof bytes, &size));
    return cob_get(bytes, size);
}

void setUp(void)
{
    const struct drive_node_port port = {take, NULL};
    sent_count = 0;
    counter = 0;
    TEST_ASSERT_EQUAL_INT(0, drive_node_init(&node, ID, &drive_bench_config, 1000000, port));
    drive_node_process(&node, 0);
    TEST_ASSERT_EQUAL_HEX32(0, refusal(0x6060, 0, CIA402_MODE_CSP, 1));
    nmt(NMT_START);
}

void tearDown(void)
{
}

/* At rest at 1 mm, following. */
static void enable(void)
{
    const uint16_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION};
    for (int i = 0; i < 3; i++) {
        setpoint(words[i], 1000000);
        (void)sync();
    }
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, node.servo.device.state);
}

static void test_boots_and_beats(void)
{
    const struct drive_node_port port = {take, NULL};
    TEST_ASSERT_EQUAL_INT(0, drive_node_init(&node, ID, &drive_bench_config, 0, port));
    sent_count = 0;
    drive_node_process(&node, 0);
    TEST_ASSERT_EQUAL_INT(1, sent_count);
    TEST_ASSERT_EQUAL_HEX32(COB_HEARTBEAT + ID, sent[0].id);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, sent[0].data[0]);
    for (int i = 0; i < 10; i++) {
        drive_node_process(&node, 10000);
    }
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, newest(COB_HEARTBEAT + ID)->data[0]);
    sent_count = 0;
    sync_number(1);
    TEST_ASSERT_EQUAL_INT(0, sent_count); /* no PDO before NMT start */
}

static void test_reports_the_instant_of_sync(void)
{
    const struct pdo_actual actual = sync();
    TEST_ASSERT_INT32_WITHIN(5, 1000000, actual.position_counts);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, cia402_decode(actual.statusword));
    TEST_ASSERT_TRUE((actual.statusword & CIA402_STATUS_REMOTE) != 0);
    TEST_ASSERT_EQUAL_INT16(0, volts());
}

/* Setpoint k, sent after SYNC k, is reached at SYNC k+2: the report there is the model's after that
 * period. */
static void test_timing_and_bits_of_the_model(void)
{
    enum { TICKS = 300 };
    struct drive model = node.servo.axis.drive;
    int32_t expected[TICKS + 2];
    enable();
    model = node.servo.axis.drive;
    for (int k = 0; k < TICKS; k++) {
        const struct pdo_actual actual = sync();
        if (k >= 2) {
            TEST_ASSERT_EQUAL_INT32(expected[k - 2], actual.position_counts);
        }
        TEST_ASSERT_TRUE((actual.statusword & CIA402_STATUS_FOLLOWS) != 0);
        if (k == 0) { /* this SYNC latched the setpoint of enable() once more */
            drive_period(&model, 1000000);
        }
        setpoint(CIA402_ENABLE_OPERATION, 1000000 + 40 * k * k);
        drive_period(&model, 1000000 + 40 * k * k);
        expected[k] = drive_position_counts(&model);
    }
}

static void test_lost_syncs_are_periods_with_the_old_target(void)
{
    enable();
    struct drive model = node.servo.axis.drive;
    setpoint(CIA402_ENABLE_OPERATION, 1002000);
    (void)sync();
    counter = (uint8_t)(counter + 2);
    setpoint(CIA402_ENABLE_OPERATION, 1005000);
    const struct pdo_actual actual = sync();
    for (int k = 0; k < 3; k++) {
        drive_period(&model, 1002000);
    }
    TEST_ASSERT_EQUAL_INT32(drive_position_counts(&model), actual.position_counts);
    TEST_ASSERT_EQUAL_INT64(2, read_object(0x2101, OD_DRIVE_SIMULATION_LOST_SYNCS));
    drive_period(&model, 1005000);
    TEST_ASSERT_EQUAL_INT32(drive_position_counts(&model), sync().position_counts);
}

static void test_repeated_sync_is_answered_without_a_period(void)
{
    enable();
    setpoint(CIA402_ENABLE_OPERATION, 1002000);
    (void)sync();
    struct pdo_actual again;
    sync_number(counter);
    const struct drive before = node.servo.axis.drive;
    sync_number(counter);
    TEST_ASSERT_EQUAL_INT(ID, pdo_decode_actual(&sent[0], &again));
    TEST_ASSERT_EQUAL_INT32(drive_position_counts(&before), again.position_counts);
    TEST_ASSERT_TRUE(before.state.motor.position_mm ==
                     node.servo.axis.drive.state.motor.position_mm);
    TEST_ASSERT_EQUAL_INT64(2, read_object(0x2101, OD_DRIVE_SIMULATION_REPEATED_SYNCS));
}

static void test_not_enabled_is_braked(void)
{
    for (int k = 0; k < 20; k++) {
        setpoint(CIA402_SHUTDOWN, 9000000);
        TEST_ASSERT_INT32_WITHIN(5, 1000000, sync().position_counts);
        TEST_ASSERT_EQUAL_INT16(0, volts());
    }
}

static void test_silence_stops_the_drive(void)
{
    enable();
    for (int k = 1; k < 100; k++) {
        setpoint(CIA402_ENABLE_OPERATION, 1000000 + 20000 * k);
        (void)sync();
        drive_node_process(&node, 1000);
    }
    sent_count = 0;
    for (int i = 0; i < 50; i++) {
        drive_node_process(&node, 10000);
    }
    TEST_ASSERT_NULL(newest(COB_EMCY + ID)); /* 500 ms is allowed */
    for (int i = 0; i < 10; i++) {
        drive_node_process(&node, 10000);
    }
    struct emcy emcy;
    TEST_ASSERT_NOT_NULL(newest(COB_EMCY + ID));
    TEST_ASSERT_EQUAL_UINT8(ID, emcy_decode(newest(COB_EMCY + ID), &emcy));
    TEST_ASSERT_EQUAL_HEX16(EMCY_SYNC_LOST, emcy.code);
    TEST_ASSERT_EQUAL_HEX64(EMCY_SYNC_LOST, read_object(0x603F, 0));
    TEST_ASSERT_EQUAL_INT64(0, read_object(0x2101, OD_DRIVE_SIMULATION_REPRODUCIBLE));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, node.servo.device.state);
    /* SYNC comes back, with any number */
    counter = 77;
    const struct pdo_actual actual = sync();
    TEST_ASSERT_EQUAL_INT64(0, read_object(0x2101, OD_DRIVE_SIMULATION_LOST_SYNCS));
    TEST_ASSERT_TRUE(actual.position_counts > 2900000 && actual.position_counts < 3100000);
    enable();
    TEST_ASSERT_EQUAL_INT64(1, read_object(0x2101, OD_DRIVE_SIMULATION_REPRODUCIBLE));
    sent_count = 0;
    drive_node_process(&node, 0);
    TEST_ASSERT_EQUAL_UINT8(ID, emcy_decode(newest(COB_EMCY + ID), &emcy));
    TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, emcy.code);
}

/* One long gap means that this process slept, not that the bus had no frames. */
static void test_a_sleeping_process_is_no_silence(void)
{
    enable();
    drive_node_process(&node, 0);
    drive_node_process(&node, 900000);
    drive_node_process(&node, 900000);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, node.servo.device.state);
}

static void test_leaving_operational_stops_the_drive(void)
{
    struct emcy emcy;
    enable();
    sent_count = 0;
    nmt(NMT_STOP);
    for (int i = 0; i < 60; i++) {
        drive_node_process(&node, 10000);
    }
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, node.servo.device.state);
    TEST_ASSERT_NULL(newest(COB_EMCY + ID)); /* not in STOPPED, CiA 301 */
    nmt(NMT_START);
    TEST_ASSERT_EQUAL_UINT8(ID, emcy_decode(newest(COB_EMCY + ID), &emcy));
    TEST_ASSERT_EQUAL_HEX16(EMCY_COMMUNICATION, emcy.code);
    sent_count = 0;
    (void)sync();
    TEST_ASSERT_EQUAL_INT64(0, read_object(0x2101, OD_DRIVE_SIMULATION_LOST_SYNCS));
}

static void test_lost_master_stops_the_drive(void)
{
    struct can_msg beat;
    write_object(0x1016, 1, 0x00010064u, 4); /* node 1, 100 ms */
    enable();
    cob_frame(&beat, COB_HEARTBEAT + 1, 1);
    beat.data[0] = NMT_OPERATIONAL;
    drive_node_receive(&node, &beat);
    sent_count = 0;
    for (int i = 0; i < 12; i++) {
        drive_node_process(&node, 10000);
    }
    struct emcy emcy;
    TEST_ASSERT_EQUAL_UINT8(ID, emcy_decode(newest(COB_EMCY + ID), &emcy));
    TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, emcy.code);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, node.servo.device.state);
}

static void test_software_limits_bind(void)
{
    write_object(0x607D, 2, 1500000, 4);
    enable();
    for (int k = 0; k < 400; k++) {
        setpoint(CIA402_ENABLE_OPERATION, 1000000 + 5000 * k);
        (void)sync();
    }
    const struct pdo_actual actual = sync();
    TEST_ASSERT_INT32_WITHIN(20, 1500000, actual.position_counts);
    TEST_ASSERT_TRUE((actual.statusword & CIA402_STATUS_LIMIT) != 0);
}

static void test_period_by_sdo(void)
{
    write_object(0x60C2, 1, 4, 1);
    TEST_ASSERT_EQUAL_UINT32(64, node.servo.axis.drive.samples);
    write_object(0x1006, 0, 2000, 4);
    TEST_ASSERT_EQUAL_UINT32(32, node.servo.axis.drive.samples);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, refusal(0x1006, 0, 1001, 4));
    TEST_ASSERT_EQUAL_UINT32(32, node.servo.axis.drive.samples);
    enable();
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, refusal(0x1006, 0, 1000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, refusal(0x60C2, 1, 1, 1));
}

static void test_objects_follow_the_model(void)
{
    TEST_ASSERT_EQUAL_INT64(1048576, read_object(0x608F, 1));
    TEST_ASSERT_EQUAL_INT64(9990265, read_object(0x6092, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, refusal(0x6060, 0, 3, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, refusal(0x1003, 0, 1, 1));
    enable();
    for (int k = 0; k < 200; k++) {
        setpoint(CIA402_ENABLE_OPERATION, 1000000 + 10000 * k);
        (void)sync();
    }
    TEST_ASSERT_EQUAL_INT64(1000000 + 10000 * 199, (int32_t)read_object(0x6062, 0));
    TEST_ASSERT_INT32_WITHIN(200000, 10000000, (int32_t)read_object(0x606C, 0));
    TEST_ASSERT_EQUAL_INT32((int32_t)read_object(0x6062, 0) - (int32_t)read_object(0x6064, 0),
                            (int32_t)read_object(0x60F4, 0));
    TEST_ASSERT_EQUAL_INT64(203, read_object(0x2101, OD_DRIVE_SIMULATION_PERIODS));
}

static void enable_by_sdo(void)
{
    write_object(0x6040, 0, CIA402_SHUTDOWN, 2);
    write_object(0x6040, 0, CIA402_SWITCH_ON, 2);
    write_object(0x6040, 0, CIA402_ENABLE_OPERATION, 2);
}

/* Switched on by SDO alone, as by a drive's own tool: stays where it is, whatever target it had before. */
static void test_enabled_by_hand_stays(void)
{
    setpoint(CIA402_SHUTDOWN, 9000000);
    (void)sync();
    (void)sync();
    enable_by_sdo();
    for (int k = 0; k < 300; k++) {
        TEST_ASSERT_INT32_WITHIN(20, 1000000, sync().position_counts);
    }
    TEST_ASSERT_EQUAL_INT64(1, read_object(0x2101, OD_DRIVE_SIMULATION_PARKED));
}

/* The last controlword counts, from whichever side it came. */
static void test_controlword_by_sdo_after_pdo(void)
{
    enable();
    write_object(0x6040, 0, CIA402_DISABLE_VOLTAGE, 2);
    (void)sync();
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, node.servo.device.state);
}

static void test_reset_node_is_power_on(void)
{
    write_object(0x607D, 2, 1500000, 4);
    enable();
    sent_count = 0;
    nmt(NMT_RESET_NODE);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, newest(COB_HEARTBEAT + ID)->data[0]);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, node.servo.device.state);
    TEST_ASSERT_EQUAL_INT64(INT32_MAX, (int32_t)read_object(0x607D, 2));
}

static void test_bad_figures_are_refused(void)
{
    struct drive_config bad = drive_bench_config;
    const struct drive_node_port port = {take, NULL};
    bad.plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_EQUAL_INT(DRIVE_ERR_PLANT, drive_node_init(&node, ID, &bad, 0, port));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_boots_and_beats);
    RUN_TEST(test_reports_the_instant_of_sync);
    RUN_TEST(test_timing_and_bits_of_the_model);
    RUN_TEST(test_lost_syncs_are_periods_with_the_old_target);
    RUN_TEST(test_repeated_sync_is_answered_without_a_period);
    RUN_TEST(test_not_enabled_is_braked);
    RUN_TEST(test_silence_stops_the_drive);
    RUN_TEST(test_a_sleeping_process_is_no_silence);
    RUN_TEST(test_leaving_operational_stops_the_drive);
    RUN_TEST(test_lost_master_stops_the_drive);
    RUN_TEST(test_software_limits_bind);
    RUN_TEST(test_period_by_sdo);
    RUN_TEST(test_objects_follow_the_model);
    RUN_TEST(test_enabled_by_hand_stays);
    RUN_TEST(test_controlword_by_sdo_after_pdo);
    RUN_TEST(test_reset_node_is_power_on);
    RUN_TEST(test_bad_figures_are_refused);
    return UNITY_END();
}
