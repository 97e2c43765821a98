/* SPDX-License-Identifier: MIT */
/* Tests of node/node_faults.h: faults injected into simulated drives. Run by `make unit`; no I/O. */
#include "node/node_faults.h"

#include <string.h>

#include "canopen/cob.h"
#include "drive_bench.h"
#include "faults/fault_rules.h"
#include "unity.h"

static const struct drive_config figures = {
    .plant = {.gain_rad_s_v = 83.0089,
              .time_constant_s = 0.19936,
              .screw_mm_rad = 1.59,
              .torque_to_volts = 1.4,
              .volts_limit = 5},
    .pdff = {.k_pp_rad_s_mm = 97.38,
             .k_pv_nm_s_rad = 1.19,
             .k_iv_per_s = 252.8,
             .k_pf_rad_mm = 0.8,
             .k_vf = 0.85},
    .encoder_counts_per_rev = 1048576,
    .loop_rate_hz = 16000,
    .counts_per_mm = 1000000,
    .period_us = 1000,
};

static struct drive_node nodes[2];
static struct fault_rules rules;
static struct node_faults faults;
static unsigned begun, ended;
static int64_t last_tick;

static void nowhere(void *context, const struct can_msg *frame)
{
    (void)context;
    (void)frame;
}

static void note(const struct fault_rule *rule, uint64_t now_ns, int64_t tick, bool on)
{
    TEST_ASSERT_TRUE(now_ns > 0u && rule->line > 0u);
    last_tick = tick;
    begun += on ? 1u : 0u;
    ended += on ? 0u : 1u;
}

void setUp(void)
{
    const struct drive_node_port port = {nowhere, NULL};
    begun = ended = 0;
    drive_bench_begin();
    TEST_ASSERT_EQUAL_INT(0, drive_node_init(&nodes[0], 2, &figures, 0, port));
    TEST_ASSERT_EQUAL_INT(0, drive_node_init(&nodes[1], 3, &figures, 0, port));
}

void tearDown(void)
{
}

static void frame(uint16_t id, uint8_t first, uint8_t target)
{
    const struct can_msg in = {.id = id, .len = 6, .data = {first, 0, target}};
    node_faults_receive(&faults, &in, 1000);
}

/* In motion: the next SYNC is tick 1 with counter 11. */
static void begin(const char *text)
{
    char reason[200] = "";
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        0, fault_rules_parse(&rules, text, strlen(text), reason, sizeof reason), reason);
    node_faults_init(&faults, &rules, nodes, 2, note);
    frame(0x203, 0x0F, 1);
    frame(0x203, 0x0F, 2);
    frame(0x080, 10, 0);
}

static void test_a_rule_acts_on_its_drive_for_its_ticks(void)
{
    begin("saturate at=2 for=3 node=3 volts=1.5\ndrop at=0 id=0x182\n");
    frame(0x080, 11, 0);
    TEST_ASSERT_TRUE(nodes[1].servo.axis.influence.volts_limit == 5.0);
    frame(0x080, 12, 0);
    TEST_ASSERT_TRUE(nodes[1].servo.axis.influence.volts_limit == 1.5);
    TEST_ASSERT_TRUE(nodes[0].servo.axis.influence.volts_limit == 5.0);
    TEST_ASSERT_EQUAL_INT64(2, last_tick);
    frame(0x080, 14, 0);
    TEST_ASSERT_TRUE(nodes[1].servo.axis.influence.volts_limit == 1.5);
    frame(0x080, 15, 0);
    TEST_ASSERT_TRUE(nodes[1].servo.axis.influence.volts_limit == 5.0);
    TEST_ASSERT_EQUAL_UINT(1, begun);
    TEST_ASSERT_EQUAL_UINT(1, ended);
}

/* Each reaches its drive with its value, and what has an end is as before. */
static void test_every_kind_of_rule(void)
{
    const struct drive_node *node = &nodes[1];
    begin("load at=1 for=2 node=3 volts=-0.5\n"
          "limit-switch at=1 for=2 node=3 side=positive\n"
          "limit-switch at=2 for=1 node=3 side=negative\n"
          "encoder-freeze at=1 for=2 node=3\n"
          "encoder-jump at=1 for=2 node=3 counts=-40\n"
          "heartbeat-stop at=1 for=2 node=3\n"
          "encoder-fault at=1 for=2 node=3\n");
    frame(0x080, 11, 0);
    TEST_ASSERT_TRUE(node->servo.axis.influence.load_volts == -0.5);
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_POSITIVE, node->servo.supervision.forced_inputs);
    TEST_ASSERT_TRUE(node->servo.axis.influence.encoder_frozen);
    TEST_ASSERT_TRUE(node->encoder_jump_mm == -40 * node->servo.axis.drive.mm_per_count);
    TEST_ASSERT_TRUE(node->without_heartbeats);
    TEST_ASSERT_TRUE(node->servo.supervision.encoder_failed);
    frame(0x080, 12, 0);
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_POSITIVE | EQUIPMENT_INPUT_NEGATIVE,
                            node->servo.supervision.forced_inputs);
    frame(0x080, 13, 0);
    TEST_ASSERT_TRUE(node->servo.axis.influence.load_volts == 0.0);
    TEST_ASSERT_EQUAL_HEX32(0, node->servo.supervision.forced_inputs);
    TEST_ASSERT_FALSE(node->servo.axis.influence.encoder_frozen);
    TEST_ASSERT_TRUE(node->encoder_jump_mm == 0.0);
    TEST_ASSERT_TRUE(node->servo.axis.influence.encoder_offset_mm == 0.0);
    TEST_ASSERT_FALSE(node->without_heartbeats);
    TEST_ASSERT_FALSE(node->servo.supervision.encoder_failed);
    TEST_ASSERT_EQUAL_UINT(7, begun);
    TEST_ASSERT_EQUAL_UINT(7, ended);
}

static void test_a_rule_that_has_no_end(void)
{
    begin("fault at=1 node=2 code=0x7305\n");
    frame(0x080, 11, 0);
    TEST_ASSERT_EQUAL_HEX16(0x7305, nodes[0].values.error_code);
    TEST_ASSERT_EQUAL_HEX16(0, nodes[1].values.error_code);
}

static void test_ms_end_without_frames(void)
{
    begin("stop at=0 for_ms=50 node=2");
    TEST_ASSERT_TRUE(nodes[0].without_power);
    TEST_ASSERT_FALSE(nodes[1].without_power);
    node_faults_process(&faults, 50000999);
    TEST_ASSERT_TRUE(nodes[0].without_power);
    node_faults_process(&faults, 50001000);
    TEST_ASSERT_FALSE(nodes[0].without_power);
}

static void test_a_rule_about_another_process(void)
{
    begin("stop at=0 node=9");
    TEST_ASSERT_EQUAL_UINT(1, begun);
    TEST_ASSERT_FALSE(nodes[0].without_power || nodes[1].without_power);
}

static void test_stop_is_silence_and_ends_in_a_boot(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_STOP}, true);
    drive_bench_setpoint(CIA402_ENABLE_OPERATION, 1000000);
    drive_bench_sync();
    drive_node_process(&bench.node, 200000);
    TEST_ASSERT_EQUAL_INT(0, bench.sent_count);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_STOP}, false);
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, drive_bench_newest(COB_HEARTBEAT)->data[0]);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.node.servo.device.state);
}

static void test_restart_boots(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_RESTART}, true);
    bench.sent_count = 0;
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, drive_bench_newest(COB_HEARTBEAT)->data[0]);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.node.servo.device.state);
    TEST_ASSERT_INT32_WITHIN(5, 1000000, (int32_t)drive_bench_read(0x6064, 0));
}

static void test_heartbeat_stop(void)
{
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_HEARTBEAT_STOP}, true);
    bench.sent_count = 0;
    drive_node_process(&bench.node, 150000);
    TEST_ASSERT_NULL(drive_bench_newest(COB_HEARTBEAT));
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_HEARTBEAT_STOP}, false);
    drive_node_process(&bench.node, 150000);
    TEST_ASSERT_NOT_NULL(drive_bench_newest(COB_HEARTBEAT));
}

static void test_code_is_a_fault(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x4210}, true);
    drive_bench_expect_emcy(0x4210, EMCY_REGISTER_TEMPERATURE | EMCY_REGISTER_GENERIC);
    drive_bench_run(200);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, bench.node.servo.device.state);
    TEST_ASSERT_EQUAL_HEX16(0x4210, drive_bench_read(0x603F, 0));
}

static void test_a_second_error_in_a_fault_is_reported_as_well(void)
{
    drive_bench_enable();
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_FAULT, .code = 0x4210}, true);
    drive_bench_expect_emcy(0x4210, EMCY_REGISTER_TEMPERATURE | EMCY_REGISTER_GENERIC);
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_ENCODER_FAULT}, true);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, bench.node.servo.device.state);
    drive_bench_run(2);
    TEST_ASSERT_EQUAL_HEX16(0x7305, drive_bench_read(0x603F, 0));
    TEST_ASSERT_EQUAL_INT(2, drive_bench_read(0x1003, 0));
    TEST_ASSERT_EQUAL_HEX16(0x7305, drive_bench_read(0x1003, 1) & 0xFFFF);
    TEST_ASSERT_EQUAL_HEX16(0x4210, drive_bench_read(0x1003, 2) & 0xFFFF);
}

static void test_saturate(void)
{
    drive_bench_fault((struct fault_rule){.kind = FAULT_KIND_SATURATE, .volts = 1.0}, true);
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
    RUN_TEST(test_a_second_error_in_a_fault_is_reported_as_well);
    RUN_TEST(test_saturate);
    RUN_TEST(test_a_rule_acts_on_its_drive_for_its_ticks);
    RUN_TEST(test_every_kind_of_rule);
    RUN_TEST(test_a_rule_that_has_no_end);
    RUN_TEST(test_ms_end_without_frames);
    RUN_TEST(test_a_rule_about_another_process);
    return UNITY_END();
}
