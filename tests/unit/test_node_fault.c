/* SPDX-License-Identifier: MIT */
#include "node/node_fault.h"

#include "canopen/cob.h"
#include "drive_bench.h"
#include "unity.h"

void setUp(void)
{
    drive_bench_begin();
}

void tearDown(void)
{
}

static void test_stop_is_silence_and_ends_in_a_boot(void)
{
    drive_bench_enable();
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_STOP, 0, true));
    drive_bench_setpoint(CIA402_ENABLE_OPERATION, 1000000);
    drive_bench_sync();
    drive_node_process(&bench.node, 200000);
    TEST_ASSERT_EQUAL_INT(0, bench.sent_count);
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_STOP, 0, false));
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, drive_bench_newest(COB_HEARTBEAT)->data[0]);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.node.device.state);
}

static void test_restart_boots(void)
{
    drive_bench_enable();
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_RESTART, 0, true));
    bench.sent_count = 0;
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, drive_bench_newest(COB_HEARTBEAT)->data[0]);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.node.device.state);
    TEST_ASSERT_INT32_WITHIN(5, 1000000, (int32_t)drive_bench_read(0x6064, 0));
}

static void test_heartbeat_stop(void)
{
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_HEARTBEAT_STOP, 0, true));
    bench.sent_count = 0;
    drive_node_process(&bench.node, 150000);
    TEST_ASSERT_NULL(drive_bench_newest(COB_HEARTBEAT));
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_HEARTBEAT_STOP, 0, false));
    drive_node_process(&bench.node, 150000);
    TEST_ASSERT_NOT_NULL(drive_bench_newest(COB_HEARTBEAT));
}

static void test_code_is_a_fault(void)
{
    drive_bench_enable();
    TEST_ASSERT_EQUAL_INT(NODE_FAULT_ERR_VALUE,
                          drive_node_fault(&bench.node, NODE_FAULT_CODE, 0, true));
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_CODE, 0x4210, true));
    drive_bench_expect_emcy(0x4210, EMCY_REGISTER_TEMPERATURE | EMCY_REGISTER_GENERIC);
    drive_bench_run(200);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, bench.node.device.state);
    TEST_ASSERT_EQUAL_HEX16(0x4210, drive_bench_read(0x603F, 0));
}

static void test_a_second_error_in_a_fault_is_told_too(void)
{
    drive_bench_enable();
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_CODE, 0x4210, true));
    drive_bench_expect_emcy(0x4210, EMCY_REGISTER_TEMPERATURE | EMCY_REGISTER_GENERIC);
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_ENCODER_FAULT, 0, true));
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, bench.node.device.state);
    drive_bench_run(2);
    TEST_ASSERT_EQUAL_HEX16(0x7305, drive_bench_read(0x603F, 0));
    TEST_ASSERT_EQUAL_INT(2, drive_bench_read(0x1003, 0));
    TEST_ASSERT_EQUAL_HEX16(0x7305, drive_bench_read(0x1003, 1) & 0xFFFF);
    TEST_ASSERT_EQUAL_HEX16(0x4210, drive_bench_read(0x1003, 2) & 0xFFFF);
}

static void test_saturate(void)
{
    TEST_ASSERT_EQUAL_INT(NODE_FAULT_ERR_VALUE,
                          drive_node_fault(&bench.node, NODE_FAULT_SATURATE, 0, true));
    TEST_ASSERT_EQUAL_INT(0, drive_node_fault(&bench.node, NODE_FAULT_SATURATE, 1.0, true));
    drive_bench_enable();
    for (int k = 0; k < 20; k++) {
        drive_bench_setpoint(CIA402_ENABLE_OPERATION, 1000000 + 400000 * k);
        drive_bench_sync();
        TEST_ASSERT_TRUE(drive_bench_volts_mv() <= 1000);
    }
    TEST_ASSERT_EQUAL_INT16(1000, drive_bench_volts_mv());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stop_is_silence_and_ends_in_a_boot);
    RUN_TEST(test_restart_boots);
    RUN_TEST(test_heartbeat_stop);
    RUN_TEST(test_code_is_a_fault);
    RUN_TEST(test_a_second_error_in_a_fault_is_told_too);
    RUN_TEST(test_saturate);
    return UNITY_END();
}
