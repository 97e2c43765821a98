/* SPDX-License-Identifier: MIT */
/* The whole controller against fake drives: finding them, switching on, running, stopping, faults. Run by
 * `make unit`; no I/O. */
#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "core/counts.h"
#include "core/interpolator.h"

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "golden.h"
#include "unity.h"

#define X_COUNTS 10000000
#define Y_COUNTS (-5000000)
#define GUARD_US 100000u /* default of 0x2004 sub 8 */

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

void setUp(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    app_image_make(image, 10, -5);
}

void tearDown(void)
{
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, bench.drives[i].cut_moving,
                                         "power was taken from a moving drive");
    }
}

static struct machine *machine(void)
{
    return &bench.controller.machine;
}

static void switch_on(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
}

static void load(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
}

static void start(void)
{
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
}

static void expect_refusal(unsigned command, enum machine_refusal refusal)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, command));
    TEST_ASSERT_EQUAL_INT(refusal, app_bench_read(&bench, 0x2003, 4));
}

static void test_boot_configures_each_drive_then_starts_it(void)
{
    app_bench_settle(&bench);
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.controller.nmt.state);
    TEST_ASSERT_EQUAL_UINT32(DRIVE_POLLING_SDO_TIMEOUT_US,
                             bench.controller.polling.client.timeout_us);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_UINT32(2, bench.starts);
    for (uint32_t i = 0; i < BENCH_DRIVES; ++i) {
        const struct fake_drive *drive = &bench.drives[i];
        TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, drive->nmt.state);
        TEST_ASSERT_EQUAL_INT(8, drive->values.modes_of_operation);
        TEST_ASSERT_EQUAL_UINT16(DRIVE_HEARTBEAT_MS, drive->values.producer_heartbeat_time);
        TEST_ASSERT_EQUAL_UINT32(1000, drive->values.communication_cycle_period);
    }
}

/* Off means that `enable` would be accepted: so not before each drive has answered a SYNC. */
static void test_configured_drives_that_do_not_answer_are_missing(void)
{
    bench.drives[1].mute = true;
    app_bench_periods(&bench, 1000);
    TEST_ASSERT_EQUAL_UINT32(2, bench.starts);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    expect_refusal(COMMAND_ENABLE, MACHINE_DRIVES_MISSING);
    bench.drives[1].mute = false;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
}

/* The command that starts a drive is a frame that may be lost: then nothing else would start it. */
static void test_drives_that_do_not_answer_are_started_again(void)
{
    bench.drives[1].mute = true;
    app_bench_periods(&bench, MACHINE_ANSWER_TICKS);
    TEST_ASSERT_EQUAL_UINT32(2, bench.starts);
    app_bench_periods(&bench, 1000);
    TEST_ASSERT_EQUAL_UINT32(4, bench.starts);
    TEST_ASSERT_EQUAL_INT64(bench.drives[1].node, app_bench_read(&bench, 0x2025, 1));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2025, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TIMEOUT, app_bench_read(&bench, 0x2025, 3));
    bench.drives[1].mute = false;
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2025, 1));
}

/* The first drive restarts while the second one is being configured, and takes its time. */
static void test_a_drive_that_restarts_in_boot_is_configured_again(void)
{
    bench.drives[1].mode_stuck = 6;
    for (unsigned k = 0; bench.controller.boot.axis == 0u; ++k) {
        TEST_ASSERT_TRUE(k < 1000u);
        app_bench_period(&bench);
    }
    fake_drive_init(&bench.drives[0], 2, X_COUNTS);
    app_bench_period(&bench);
    bench.drives[1].mode_stuck = 0;
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
    uint32_t first = 0;
    TEST_ASSERT_EQUAL_UINT32(1, fake_drive_written(&bench.drives[0], 0x606000, &first));
}

static void test_travel_limits_reach_the_drives(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, (uint32_t)-7, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2007, 2, 20000000, 4));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT32(-7, bench.drives[0].values.software_position_limit[0]);
    TEST_ASSERT_EQUAL_INT32(20000000, bench.drives[1].values.software_position_limit[1]);
}

static void test_a_missing_drive_is_named_and_found_later(void)
{
    bench.drives[1].dead = true;
    app_bench_periods(&bench, 1200);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, app_bench_read(&bench, 0x2002, 0));
    TEST_ASSERT_EQUAL_INT(3, app_bench_read(&bench, 0x2003, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TIMEOUT, app_bench_read(&bench, 0x2003, 3));
    expect_refusal(COMMAND_ENABLE, MACHINE_DRIVES_MISSING);
    bench.drives[1].dead = false;
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
}

static void test_a_device_that_is_no_drive_is_refused(void)
{
    bench.drives[0].values.device_type = 401;
    app_bench_periods(&bench, 1200);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    TEST_ASSERT_EQUAL_INT(2, app_bench_read(&bench, 0x2003, 2));
}

static void test_switching_on_moves_nothing(void)
{
    switch_on();
    app_bench_periods(&bench, 20);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, bench.drives[1].position_counts);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS, app_bench_read(&bench, 0x200D, 1));
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, app_bench_read(&bench, 0x200B, 2));
}

static void test_each_start_condition(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    expect_refusal(COMMAND_START, MACHINE_NO_PROGRAM);
    load();
    expect_refusal(COMMAND_START, MACHINE_DRIVES_OFF);
    switch_on();
    expect_refusal(COMMAND_START, MACHINE_MOVING); /* not yet 250 periods of standstill */
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS - 5u);
    expect_refusal(COMMAND_START, MACHINE_MOVING);
    app_bench_periods(&bench, 6);
    app_image_make(image, 11, -5);
    load();
    expect_refusal(COMMAND_START, MACHINE_AWAY_FROM_START);
    app_image_make(image, 10, -5);
    load();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    expect_refusal(COMMAND_START, MACHINE_MOVING);
    expect_refusal(COMMAND_DISABLE, MACHINE_MOVING);
}

static void test_limits_tightened_after_the_upload_refuse_the_start(void)
{
    load();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 2, 14000, 4));
    switch_on();
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    expect_refusal(COMMAND_START, MACHINE_OUTSIDE_LIMITS);
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_FEED, app_bench_read(&bench, 0x2000, 3));
}

/* The setpoints on the bus are those of the interpolator, from tick 0, one each period. */
static void test_setpoints_are_those_of_the_interpolator(void)
{
    load();
    switch_on();
    start();
    const uint32_t ticks = app_bench_until(&bench, MACHINE_READY, 2000);
    TEST_ASSERT_EQUAL_UINT32(APP_IMAGE_TICKS + MACHINE_SETTLE_TICKS, ticks);
    struct program program;
    struct golden_precomputed precomputed;
    struct interpolator interp;
    struct interpolator_point point;
    TEST_ASSERT_EQUAL_INT(0, program_open(&program, image, sizeof image));
    golden_precompute(&precomputed, &program, KERNEL_FIXED);
    TEST_ASSERT_EQUAL_INT(0, interpolator_begin(&interp, &precomputed.program));
    for (uint32_t k = 0; k < APP_IMAGE_TICKS; ++k) {
        const uint64_t time_q42_s = ((uint64_t)k * 4398046511104u + 500u) / 1000u;
        TEST_ASSERT_TRUE(interpolator_at_q42(&interp, time_q42_s, &point) >= 0);
        TEST_ASSERT_EQUAL_INT32(counts_from_q40_mm(point.position_q40[0], 1000000),
                                bench.targets[0][k]);
        TEST_ASSERT_EQUAL_INT32(counts_from_q40_mm(point.position_q40[1], 1000000),
                                bench.targets[1][k]);
    }
    golden_discard(&precomputed);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 4000000, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_UINT32(APP_IMAGE_TICKS - 1u, app_bench_read(&bench, 0x2008, 2));
    TEST_ASSERT_EQUAL_UINT32(0, app_bench_read(&bench, 0x2008, 6));
    TEST_ASSERT_EQUAL_INT64(INT64_C(4) << 40, app_bench_read(&bench, 0x2009, 1));
}

static void test_stop_ends_on_the_path_and_runs_again_only_from_the_start(void)
{
    load();
    switch_on();
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_TRUE(app_bench_read(&bench, 0x2009, 2) > 14900);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    TEST_ASSERT_EQUAL_INT(MACHINE_STOPPING, machine()->state);
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, bench.drives[1].position_counts);
    TEST_ASSERT_TRUE(bench.drives[0].position_counts > X_COUNTS + 2000000);
    TEST_ASSERT_TRUE(bench.drives[0].position_counts < X_COUNTS + 4000000);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 15001);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    expect_refusal(COMMAND_START, MACHINE_AWAY_FROM_START);
}

static void test_disable_and_stop_when_there_is_nothing_to_do(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
}

static void test_upload_while_running_changes_nothing(void)
{
    load();
    switch_on();
    start();
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2004, 2, 50000, 4));
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 4000000, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_READY, app_bench_read(&bench, 0x2000, 2));
}

static void test_a_refused_image_leaves_the_old_program(void)
{
    load();
    const int64_t crc = app_bench_read(&bench, 0x2000, 5);
    image[150] ^= 1u;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CRC, app_bench_read(&bench, 0x2000, 3));
    TEST_ASSERT_EQUAL_INT64(crc, app_bench_read(&bench, 0x2000, 5));
    TEST_ASSERT_EQUAL_INT(PROGRAM_SLOT_READY, app_bench_read(&bench, 0x2000, 2));
    TEST_ASSERT_EQUAL_UINT32(APP_IMAGE_TICKS, app_bench_read(&bench, 0x2000, 9));
    TEST_ASSERT_EQUAL_INT32(X_COUNTS, app_bench_read(&bench, 0x2000, 12));
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, app_bench_read(&bench, 0x2000, 15));
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 4000000, app_bench_read(&bench, 0x2000, 14));
}

static void test_what_is_reported_of_the_program(void)
{
    for (uint8_t sub = 2; sub <= 15u; ++sub) {
        TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2000, sub));
    }
    load();
    const int64_t expected[] = {
        PROGRAM_SLOT_READY,
        0,
        0,
        (int64_t)cob_get(image + 12, 4),
        APP_IMAGE_SIZE,
        1,
        1,
        APP_IMAGE_TICKS,
        INT64_C(1) << 31,
        INT64_C(4) << 40,
        X_COUNTS,
        Y_COUNTS,
        X_COUNTS + 4000000,
        Y_COUNTS,
    };
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; ++i) {
        const int64_t found = app_bench_read(&bench, 0x2000, (uint8_t)(i + 2u));
        TEST_ASSERT_EQUAL_INT64(expected[i], i == 3u ? found & UINT32_MAX : found);
    }
    bench.controller.slot.refused.index = 77;
    TEST_ASSERT_EQUAL_INT64(77, app_bench_read(&bench, 0x2000, 4));
}

static void test_the_active_image_can_be_read_back(void)
{
    static uint8_t back[APP_IMAGE_SIZE];
    struct can_msg out;
    load();
    TEST_ASSERT_EQUAL_INT(0, sdo_client_read(&bench.host, 1, 0x2000, 1, back, sizeof back, &out));
    fake_port_receive(&out);
    app_bench_settle(&bench);
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, bench.host.status);
    TEST_ASSERT_EQUAL_UINT32(sizeof image, bench.host.size);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(image, back, sizeof image);
}

static void test_configuration_only_while_off_and_same_values_cost_nothing(void)
{
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2004, 2, 50000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2006, 1, 0, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    const uint64_t same = (uint64_t)app_bench_read(&bench, 0x2006, 1);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, same, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, same + 1u, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
}

static void test_the_period_changes_everywhere(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_write(&bench, 0x1006, 0, 3000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1006, 0, 2000, 4));
    TEST_ASSERT_EQUAL_UINT32(2000, fake_port_period_us());
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_UINT32(2000, bench.drives[1].values.communication_cycle_period);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_PERIOD_USED, app_bench_read(&bench, 0x2000, 3));
}

static void run_some(uint32_t periods)
{
    load();
    switch_on();
    start();
    app_bench_periods(&bench, periods);
}

static void test_a_drive_fault_stops_the_other_on_the_path(void)
{
    run_some(250);
    (void)cia402_device_fault(&bench.drives[1].state);
    (void)cia402_device_stopped(&bench.drives[1].state);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, app_bench_read(&bench, 0x2002, 0));
    TEST_ASSERT_EQUAL_INT(3, app_bench_read(&bench, 0x2003, 2));
    TEST_ASSERT_EQUAL_HEX16(EMCY_GENERIC, bench.emergency);
    expect_refusal(COMMAND_ENABLE, MACHINE_FAULT_PRESENT);
    app_bench_periods(&bench, 1000);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 15001);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_RESET));
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, bench.emergency);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x1001, 0));
}

static void test_the_drives_own_error_code_becomes_the_fault(void)
{
    run_some(100);
    struct can_msg emcy;
    cob_frame(&emcy, COB_EMCY + 2u, 8);
    cob_put(emcy.data, 0x7300, 2);
    (void)cia402_device_fault(&bench.drives[0].state);
    app_bench_period(&bench);
    fake_port_receive(&emcy);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(0x7300, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_HEX16(0x7300, app_bench_read(&bench, 0x200C, 1));
}

static void test_one_missed_answer_is_counted_and_tolerated(void)
{
    run_some(100);
    bench.drives[0].mute = true;
    app_bench_period(&bench);
    bench.drives[0].mute = false;
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2008, 6));
}

static void test_a_lost_heartbeat_is_a_fault(void)
{
    for (uint32_t i = 0; i < BENCH_DRIVES; ++i) {
        setUp();
        switch_on();
        app_bench_periods(&bench,
                          2u * DRIVE_HEARTBEAT_MS); /* monitoring begins with the first one */
        bench.drives[i].silent_heart = true;
        const uint32_t periods = app_bench_until(&bench, MACHINE_FAULT, 1200);
        TEST_ASSERT_UINT32_WITHIN(DRIVE_HEARTBEAT_MS, 1000, periods);
        TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, app_bench_read(&bench, 0x2003, 1));
        TEST_ASSERT_EQUAL_INT(bench.drives[i].node, app_bench_read(&bench, 0x2003, 2));
    }
}

static void test_a_drive_that_restarts_while_off_is_configured_again(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    app_bench_periods(&bench, 200);
    fake_drive_init(&bench.drives[0], 2, X_COUNTS);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT(8, bench.drives[0].values.modes_of_operation);
}

static void test_a_drive_that_is_gone_while_off_is_looked_for_again(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    app_bench_periods(&bench, 10);
    bench.drives[1].dead = true;
    (void)app_bench_until(&bench, MACHINE_BOOT, 1010u);
    bench.drives[1].dead = false;
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

/* A stall of the main loop does not count in the client's timeout: its transfer continues. */
static void test_a_busy_main_loop_ends_no_transfer(void)
{
    struct can_msg frame;
    app_bench_settle(&bench);
    TEST_ASSERT_EQUAL_INT(0,
                          sdo_client_write(&bench.host, 1, 0x2000, 1, image, sizeof image, &frame));
    fake_port_receive(&frame);
    controller_poll(&bench.controller);
    fake_port_advance_us(10000000);
    controller_poll(&bench.controller);
    TEST_ASSERT_TRUE(bench.controller.server.state != SDO_SERVER_IDLE);
    app_bench_settle(&bench);
    TEST_ASSERT_EQUAL_INT(SDO_CLIENT_DONE, bench.host.status);
}

/* A watchdog lives on it: at the segment, the piece, each of its stops, at both records, and, with limits of an axis, at
 * each part of it. */
static void test_a_check_reports_its_progress_to_the_port(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    const unsigned before = fake_port_progress();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_UINT(before + 6u, fake_port_progress());
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_UINT(before + 6u, fake_port_progress());
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2030, 1, 20000, 4));
    (void)app_bench_read(&bench, 0x2000, 12); /* checks it anew */
    TEST_ASSERT_EQUAL_UINT(before + 6u + 5u, fake_port_progress());
}

static void test_simulated_drives_are_awaited_and_hurried_while_something_moves(void)
{
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_awaited_us());
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(GUARD_US, fake_port_awaited_us());
    TEST_ASSERT_FALSE(fake_port_hurry());
    switch_on();
    app_bench_period(&bench);
    TEST_ASSERT_TRUE(fake_port_hurry());
    TEST_ASSERT_TRUE(fake_port_ready());
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_FALSE(fake_port_hurry());
    TEST_ASSERT_EQUAL_UINT32(GUARD_US, fake_port_awaited_us());
    bench.drives[0].mute = true;
    app_bench_period(&bench);
    TEST_ASSERT_FALSE(fake_port_ready());
    app_bench_periods(&bench, 102u);
    TEST_ASSERT_TRUE_MESSAGE(fake_port_ready(), "the other one alone keeps the pace");
    bench.drives[1].mute = true;
    app_bench_periods(&bench, 102u);
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_awaited_us());
}

static void test_real_drives_are_never_awaited(void)
{
    bench.drives[1].values.identity_object.vendor_id = 0x123;
    bench.drives[1].values.tpdo2_communication_parameter.cob_id |= 0x80000000u;
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    switch_on();
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_awaited_us());
}

static void test_late_ticks_of_a_run_are_counted(void)
{
    run_some(1);
    fake_port_tick(5000000);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2008, 3));
    TEST_ASSERT_EQUAL_INT(5000, app_bench_read(&bench, 0x2008, 4));
    fake_port_tick(1000000);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2008, 3));
    fake_port_tick(1000001);
    TEST_ASSERT_EQUAL_INT(2, app_bench_read(&bench, 0x2008, 3));
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    fake_port_tick(9000000);
    TEST_ASSERT_EQUAL_INT(2, app_bench_read(&bench, 0x2008, 3));
}

static void tick_in_wait(void *context)
{
    (void)context;
    app_bench_period(&bench);
}

static void test_shutting_down_while_running_stops_on_the_path(void)
{
    run_some(250);
    fake_port_on_wait(tick_in_wait, NULL);
    TEST_ASSERT_TRUE(controller_shut_down(&bench.controller));
    app_bench_settle(&bench);
    TEST_ASSERT_LESS_THAN_INT32(X_COUNTS + 3700000, bench.drives[0].position_counts);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 15001);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
    TEST_ASSERT_EQUAL_INT(NMT_PRE_OPERATIONAL, bench.drives[1].nmt.state);
}

static void test_shutting_down_at_any_instant(void)
{
    for (uint32_t ticks = 1; ticks < APP_IMAGE_TICKS + 300u; ticks += 13u) {
        setUp();
        run_some(ticks);
        fake_port_on_wait(tick_in_wait, NULL);
        TEST_ASSERT_TRUE(controller_shut_down(&bench.controller));
        TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
        TEST_ASSERT_EQUAL_UINT32(0, bench.drives[0].cut_moving);
    }
}

static void start_in_wait(void *context)
{
    static const enum command beginnings[] = {COMMAND_ENABLE, COMMAND_START, COMMAND_START_FROM,
                                              COMMAND_HOME};
    app_bench_period(&bench);
    for (unsigned i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i) {
        TEST_ASSERT_EQUAL_INT(MACHINE_ENDING, commands_execute(&bench.controller, beginnings[i]));
    }
    ++*(unsigned *)context;
}

static void test_nothing_begins_during_shutdown(void)
{
    unsigned waits = 0;
    run_some(250);
    fake_port_on_wait(start_in_wait, &waits);
    TEST_ASSERT_TRUE(controller_shut_down(&bench.controller));
    TEST_ASSERT_TRUE(waits > 50u);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
}

static void insist(void *context)
{
    app_bench_period(&bench);
    fake_port_insist(++*(unsigned *)context >= 3u);
}

static void test_whoever_insists_gets_the_quick_stop(void)
{
    unsigned waits = 0;
    run_some(250);
    fake_port_on_wait(insist, &waits);
    TEST_ASSERT_TRUE(controller_shut_down(&bench.controller));
    app_bench_settle(&bench);
    TEST_ASSERT_TRUE(waits < 30u);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
}

/* The drives make the stop that the path does not. */
static void late_stop(unsigned command, enum machine_state state)
{
    run_some(100);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, command));
    TEST_ASSERT_EQUAL_INT(state, machine()->state);
    machine()->motion.feed.left_q30 = 0;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_HEX16(FAULT_STOP_LATE, machine()->fault.code);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
}

static void test_a_hold_beyond_its_deadline(void)
{
    late_stop(COMMAND_HOLD, MACHINE_HOLDING);
}

static void test_a_stop_beyond_its_deadline(void)
{
    late_stop(COMMAND_STOP, MACHINE_STOPPING);
}

static void test_a_fault_stop_beyond_its_deadline(void)
{
    run_some(100);
    port_lock();
    machine_raise(machine(), EMCY_HEARTBEAT, 3, 0);
    port_unlock();
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    machine()->motion.feed.left_q30 = 0;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, machine()->fault.code);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
}

static void test_shutting_down_is_bounded_when_ticks_do_not_come(void)
{
    run_some(250);
    const uint32_t began_us = port_time_us();
    TEST_ASSERT_FALSE(controller_shut_down(&bench.controller));
    TEST_ASSERT_TRUE(port_time_us() - began_us < 11000000u);
}

static void test_a_full_port_is_counted(void)
{
    run_some(10);
    fake_port_fail_send(true);
    fake_port_tick(0);
    fake_port_fail_send(false);
    TEST_ASSERT_EQUAL_INT(3, app_bench_read(&bench, 0x2008, 7));
}

static void test_nmt_reset_is_executed_only_while_off(void)
{
    struct can_msg reset;
    nmt_master_command(NMT_RESET_NODE, 1, &reset);
    switch_on();
    fake_port_receive(&reset);
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(MACHINE_READY, machine()->state);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    fake_port_receive(&reset);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.controller.nmt.state);
}

/* A reset and commands that come in the same round of the main loop, in either order. */
static void test_nmt_reset_beside_a_command(void)
{
    struct can_msg reset;
    struct can_msg command;
    nmt_master_command(NMT_RESET_NODE, 1, &reset);
    cob_frame(&command, COB_SDO_REQUEST + 1u, 8);
    command.data[0] = 0x2F;
    cob_put16(command.data + 1, 0x2001);
    for (unsigned number = COMMAND_ENABLE; number <= (unsigned)COMMAND_HOME; ++number) {
        setUp();
        switch_on();
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
        command.data[4] = (uint8_t)number;
        fake_port_receive(&reset);
        fake_port_receive(&command);
        controller_poll(&bench.controller);
        TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    }
    setUp();
    load();
    switch_on();
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    command.data[4] = COMMAND_START;
    fake_port_receive(&command);
    fake_port_receive(&reset);
    controller_poll(&bench.controller);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.controller.nmt.state);
}

static void test_a_reset_gives_objects_their_defaults(void)
{
    struct can_msg reset;
    struct od_controller *values = &bench.controller.values;
    const uint32_t tolerance = od_controller_defaults.configuration.start_tolerance_counts;
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    values->producer_heartbeat_time = 77;
    values->configuration.start_tolerance_counts = tolerance + 1u;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2060, 16, 0, 1));
    nmt_master_command(NMT_RESET_COMMUNICATION, 1, &reset);
    fake_port_receive(&reset);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT16(od_controller_defaults.producer_heartbeat_time,
                             values->producer_heartbeat_time);
    TEST_ASSERT_EQUAL_UINT32(tolerance + 1u, bench.controller.config.start_tolerance_counts);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2060, 16));
    nmt_master_command(NMT_RESET_NODE, 1, &reset);
    fake_port_receive(&reset);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(tolerance, bench.controller.config.start_tolerance_counts);
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x2060, 16));
    TEST_ASSERT_EQUAL_HEX32(0x81, values->cob_id_emcy);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_boot_configures_each_drive_then_starts_it);
    RUN_TEST(test_configured_drives_that_do_not_answer_are_missing);
    RUN_TEST(test_drives_that_do_not_answer_are_started_again);
    RUN_TEST(test_a_drive_that_restarts_in_boot_is_configured_again);
    RUN_TEST(test_travel_limits_reach_the_drives);
    RUN_TEST(test_a_missing_drive_is_named_and_found_later);
    RUN_TEST(test_a_device_that_is_no_drive_is_refused);
    RUN_TEST(test_switching_on_moves_nothing);
    RUN_TEST(test_each_start_condition);
    RUN_TEST(test_limits_tightened_after_the_upload_refuse_the_start);
    RUN_TEST(test_setpoints_are_those_of_the_interpolator);
    RUN_TEST(test_stop_ends_on_the_path_and_runs_again_only_from_the_start);
    RUN_TEST(test_disable_and_stop_when_there_is_nothing_to_do);
    RUN_TEST(test_upload_while_running_changes_nothing);
    RUN_TEST(test_a_refused_image_leaves_the_old_program);
    RUN_TEST(test_what_is_reported_of_the_program);
    RUN_TEST(test_the_active_image_can_be_read_back);
    RUN_TEST(test_configuration_only_while_off_and_same_values_cost_nothing);
    RUN_TEST(test_the_period_changes_everywhere);
    RUN_TEST(test_a_drive_fault_stops_the_other_on_the_path);
    RUN_TEST(test_the_drives_own_error_code_becomes_the_fault);
    RUN_TEST(test_one_missed_answer_is_counted_and_tolerated);
    RUN_TEST(test_a_lost_heartbeat_is_a_fault);
    RUN_TEST(test_a_drive_that_restarts_while_off_is_configured_again);
    RUN_TEST(test_a_drive_that_is_gone_while_off_is_looked_for_again);
    RUN_TEST(test_a_busy_main_loop_ends_no_transfer);
    RUN_TEST(test_a_check_reports_its_progress_to_the_port);
    RUN_TEST(test_simulated_drives_are_awaited_and_hurried_while_something_moves);
    RUN_TEST(test_real_drives_are_never_awaited);
    RUN_TEST(test_late_ticks_of_a_run_are_counted);
    RUN_TEST(test_shutting_down_while_running_stops_on_the_path);
    RUN_TEST(test_shutting_down_at_any_instant);
    RUN_TEST(test_nothing_begins_during_shutdown);
    RUN_TEST(test_whoever_insists_gets_the_quick_stop);
    RUN_TEST(test_a_hold_beyond_its_deadline);
    RUN_TEST(test_a_stop_beyond_its_deadline);
    RUN_TEST(test_a_fault_stop_beyond_its_deadline);
    RUN_TEST(test_shutting_down_is_bounded_when_ticks_do_not_come);
    RUN_TEST(test_a_full_port_is_counted);
    RUN_TEST(test_nmt_reset_is_executed_only_while_off);
    RUN_TEST(test_nmt_reset_beside_a_command);
    RUN_TEST(test_a_reset_gives_objects_their_defaults);
    return UNITY_END();
}
