/* SPDX-License-Identifier: MIT */
/* Implements drive_bench.h (see there): one simulated drive on the bench. Part of the C tests; no I/O. */
#include "drive_bench.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "unity.h"

struct drive_bench bench;

const struct drive_config drive_bench_config = {
    .plant = {83.0089, 0.19936, 1.59, 1.0 / 0.716, 5.0},
    .pdff = {97.38, 1.19, 252.8, 0.8, 0.85},
    .encoder_counts_per_rev = 1u << 20,
    .loop_rate_hz = 16000,
    .counts_per_mm = 1000000,
    .period_us = 1000,
};

static void drive_bench_take(void *context, const struct can_msg *frame)
{
    (void)context;
    if (bench.sent_count < DRIVE_BENCH_SENT) {
        bench.sent[bench.sent_count++] = *frame;
    }
}

void drive_bench_begin_with(const struct drive_config *config)
{
    const struct drive_node_port port = {drive_bench_take, NULL};
    memset(&bench, 0, sizeof bench);
    bench.target = 1000000;
    TEST_ASSERT_EQUAL_INT(0,
                          drive_node_init(&bench.node, DRIVE_BENCH_ID, config, bench.target, port));
    drive_node_process(&bench.node, 0);
    bench.node.values.modes_of_operation = CIA402_MODE_CSP; /* as the controller configures it */
    servo_take_mode(&bench.node.servo);
    drive_bench_nmt(NMT_START);
}

void drive_bench_begin(void)
{
    drive_bench_begin_with(&drive_bench_config);
}

void drive_bench_nmt(enum nmt_command command)
{
    struct can_msg frame;
    nmt_master_command(command, 0, &frame);
    drive_node_receive(&bench.node, &frame);
    drive_node_process(&bench.node, 0);
}

const struct can_msg *drive_bench_newest(uint32_t function)
{
    for (int i = bench.sent_count - 1; i >= 0; i--) {
        if (bench.sent[i].id == function + DRIVE_BENCH_ID) {
            return &bench.sent[i];
        }
    }
    return NULL;
}

void drive_bench_setpoint(uint16_t controlword, int32_t target)
{
    const struct pdo_setpoint values = {.target_counts = target, .controlword = controlword};
    struct can_msg frame;
    bench.word = controlword;
    bench.target = target;
    pdo_encode_setpoint(DRIVE_BENCH_ID, &values, &frame);
    drive_node_receive(&bench.node, &frame);
}

void drive_bench_sync(void)
{
    struct can_msg frame;
    bench.counter = (uint8_t)(bench.counter % 240 + 1);
    cob_frame(&frame, COB_SYNC, 1);
    frame.data[0] = bench.counter;
    bench.sent_count = 0;
    drive_node_receive(&bench.node, &frame);
}

void drive_bench_run(int periods)
{
    for (int i = 0; i < periods; i++) {
        drive_bench_setpoint(bench.word, bench.target);
        drive_bench_sync();
        drive_node_process(&bench.node, 1000);
    }
}

void drive_bench_enable(void)
{
    const uint16_t words[] = {CIA402_SHUTDOWN, CIA402_SWITCH_ON, CIA402_ENABLE_OPERATION};
    bench.target = (int32_t)drive_bench_read(0x6064, 0);
    for (int i = 0; i < 3; i++) {
        bench.word = words[i];
        drive_bench_run(1);
    }
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.node.servo.device.state);
}

void drive_bench_fault(struct fault_rule rule, bool on)
{
    node_faults_carry_out(&bench.node, &rule, on);
}

static struct pdo_actual drive_bench_actual(void)
{
    struct pdo_actual actual = {0, 0};
    const struct can_msg *frame = drive_bench_newest(COB_TPDO1);
    TEST_ASSERT_NOT_NULL(frame);
    TEST_ASSERT_EQUAL_INT(DRIVE_BENCH_ID, pdo_decode_actual(frame, &actual));
    return actual;
}

uint16_t drive_bench_statusword(void)
{
    return drive_bench_actual().statusword;
}

int32_t drive_bench_position(void)
{
    return drive_bench_actual().position_counts;
}

int16_t drive_bench_volts_mv(void)
{
    int16_t volts_mv = 0;
    TEST_ASSERT_NOT_NULL(drive_bench_newest(COB_TPDO2));
    TEST_ASSERT_EQUAL_INT(DRIVE_BENCH_ID,
                          pdo_decode_volts(drive_bench_newest(COB_TPDO2), &volts_mv));
    return volts_mv;
}

void drive_bench_expect_emcy(uint16_t code, uint8_t error_register)
{
    struct emcy emcy;
    drive_node_process(&bench.node, 0);
    TEST_ASSERT_NOT_NULL(drive_bench_newest(COB_EMCY));
    TEST_ASSERT_EQUAL_UINT8(DRIVE_BENCH_ID, emcy_decode(drive_bench_newest(COB_EMCY), &emcy));
    TEST_ASSERT_EQUAL_HEX16(code, emcy.code);
    TEST_ASSERT_EQUAL_HEX8(error_register, emcy.error_register);
}

static const struct od_entry *drive_bench_entry(uint16_t index, uint8_t sub)
{
    const struct od_entry *entry = od_find(&bench.node.od, index, sub);
    TEST_ASSERT_NOT_NULL(entry);
    return entry;
}

uint32_t drive_bench_write(uint16_t index, uint8_t sub, int64_t value)
{
    const struct od_entry *entry = drive_bench_entry(index, sub);
    uint8_t bytes[8];
    cob_put(bytes, (uint64_t)value, entry->size);
    return od_write(&bench.node.od, entry, bytes, entry->size);
}

int64_t drive_bench_read(uint16_t index, uint8_t sub)
{
    const struct od_entry *entry = drive_bench_entry(index, sub);
    const int is_signed = entry->type >= OD_INTEGER8 && entry->type <= OD_INTEGER32;
    uint8_t bytes[8];
    uint32_t size = 0;
    TEST_ASSERT_EQUAL_HEX32(0, od_read(&bench.node.od, entry, bytes, sizeof bytes, &size));
    return is_signed ? cob_signed(cob_get(bytes, size), size) : (int64_t)cob_get(bytes, size);
}
