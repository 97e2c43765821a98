/* SPDX-License-Identifier: MIT */
/* Tests of app/drives/homing.h: command 10, which homes one axis after the other. Run by `make unit`; no I/O. */
#include "app/drives/homing.h"

#include "app/commands.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "unity.h"

static struct app_bench bench;

void setUp(void)
{
    app_bench_init(&bench, 10000000, -5000000);
}

void tearDown(void)
{
}

static struct machine *machine(void)
{
    return &bench.controller.machine;
}

static void want(uint8_t axis, int8_t method, int32_t offset)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, axis, (uint8_t)method, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2013, axis, (uint32_t)offset, 4));
    bench.drives[axis - 1u].homing_syncs = 50;
}

static void boot(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
}

static void home(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOME));
    TEST_ASSERT_EQUAL_INT(MACHINE_HOMING, machine()->state);
}

static void expect_refusal(enum machine_refusal refusal)
{
    const enum machine_state before = machine()->state;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_HOME));
    TEST_ASSERT_EQUAL_INT64(refusal, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_INT(before, machine()->state);
}

static void expect_start_refusal(enum machine_refusal refusal)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT64(refusal, app_bench_read(&bench, 0x2003, 4));
}

static void test_axes_one_after_the_other_from_off_to_off(void)
{
    want(1, 37, 1000);
    want(2, 17, -2000);
    boot();
    home();
    app_bench_periods(&bench, 20);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.drives[0].state.state);
    TEST_ASSERT_EQUAL_INT(6, bench.drives[0].values.modes_of_operation);
    TEST_ASSERT_EQUAL_INT(8, bench.drives[1].values.modes_of_operation);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[1].state.state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT32(1000, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT32(-2000, bench.drives[1].position_counts);
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        TEST_ASSERT_EQUAL_INT(8, bench.drives[i].values.modes_of_operation);
        TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[i].state.state);
        TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x2017, (uint8_t)(i + 1u)));
        TEST_ASSERT_EQUAL_UINT32(0, bench.drives[i].worst_step_counts);
    }
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT32(1000, bench.drives[0].position_counts);
}

static void test_axes_in_their_sequence(void)
{
    want(1, 37, 1000);
    want(2, 17, -2000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2034, 1, 3, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2034, 2, 2, 1));
    boot();
    home();
    app_bench_periods(&bench, 20);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.drives[1].state.state);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, bench.drives[0].state.state);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2034, 2, 4, 1));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT32(1000, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT32(-2000, bench.drives[1].position_counts);
}

static void test_the_sequence_has_a_limit_and_leaves_drives_alone(void)
{
    boot();
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_TOO_HIGH, app_bench_write(&bench, 0x2034, 1, 16, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2034, 1, 15, 1));
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
}

static void test_only_axes_with_a_method(void)
{
    want(2, 35, 7);
    boot();
    home();
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT32(10000000, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2017, 1));
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x2017, 2));
    TEST_ASSERT_EQUAL_UINT32(1, fake_drive_written(&bench.drives[0], 0x606000, NULL));
}

static void test_refusals(void)
{
    expect_refusal(MACHINE_DRIVES_MISSING);
    boot();
    expect_refusal(MACHINE_NOTHING_TO_HOME);
    bench.drives[0].values.supported_drive_modes = 0x80;
    want(1, 37, 0);
    boot();
    expect_refusal(MACHINE_NO_HOMING_MODE);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    expect_refusal(MACHINE_DRIVES_ON);
}

static void test_nothing_else_while_homing(void)
{
    want(1, 17, 0);
    boot();
    home();
    app_bench_periods(&bench, 10);
    expect_refusal(MACHINE_MOVING);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_ENABLE));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2012, 1, 0, 1));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
}

static void expect_fault(uint16_t code, unsigned node)
{
    (void)app_bench_until(&bench, MACHINE_FAULT, 20000);
    TEST_ASSERT_EQUAL_HEX16(code, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT64(node, app_bench_read(&bench, 0x2003, 2));
    app_bench_periods(&bench, 10);
    TEST_ASSERT_FALSE(homing_busy(&bench.controller.homing));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2017, 1));
}

/* After a fault the reset configures the drives anew, so the mode is the right one again. */
static void expect_way_out(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_RESET));
    app_bench_periods(&bench, 2);
    boot();
    TEST_ASSERT_EQUAL_INT(8, bench.drives[0].values.modes_of_operation);
}

static void test_a_homing_error_is_a_fault(void)
{
    want(1, 17, 0);
    bench.drives[0].homing_fails = true;
    boot();
    home();
    expect_fault(FAULT_HOMING_FAILED, 2);
    app_bench_periods(&bench, 100);
    expect_way_out();
}

static void test_no_end_is_a_fault(void)
{
    want(1, 17, 0);
    bench.drives[0].homing_syncs = UINT32_MAX;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, 0, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2007, 1, 2000000, 4));
    boot();
    home();
    TEST_ASSERT_EQUAL_UINT32(2u + HOMING_SPARE_S, homing_time_s(&machine()->config, 0));
    app_bench_periods(&bench, 11900);
    TEST_ASSERT_EQUAL_INT(MACHINE_HOMING, machine()->state);
    expect_fault(FAULT_HOMING_LATE, 2);
    app_bench_periods(&bench, 100);
    expect_way_out();
}

static void test_a_mode_that_is_not_taken_is_a_fault(void)
{
    want(1, 17, 0);
    boot();
    bench.drives[0].mode_stuck = 8;
    home();
    expect_fault(FAULT_HOMING_MODE, 2);
    bench.drives[0].mode_stuck = 0;
    expect_way_out();
}

static void test_a_drive_that_stops_sending_is_a_fault(void)
{
    want(1, 17, 0);
    boot();
    home();
    app_bench_periods(&bench, 20);
    bench.drives[0].dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 1500);
    app_bench_periods(&bench, 10);
    TEST_ASSERT_FALSE(homing_busy(&bench.controller.homing));
}

/* Whatever breaks it off: no axis stays under power, and the drives are themselves again. */
static void break_off(unsigned command)
{
    app_bench_init(&bench, 10000000, -5000000);
    want(1, 17, 0);
    bench.drives[0].homing_syncs = 100000;
    boot();
    home();
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_INT(HOMING_MOVE, bench.controller.homing.phase);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, command));
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
    TEST_ASSERT_FALSE(axis_enabled(&machine()->axes[0]));
    TEST_ASSERT_NOT_EQUAL_INT(CIA402_OPERATION_ENABLED, bench.drives[0].state.state);
    boot();
    TEST_ASSERT_FALSE(homing_busy(&bench.controller.homing));
    TEST_ASSERT_EQUAL_INT(8, bench.drives[0].values.modes_of_operation);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2017, 1));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
}

static void test_stop_and_quick_stop_break_it_off(void)
{
    break_off(COMMAND_STOP);
    break_off(COMMAND_QUICK_STOP);
    break_off(COMMAND_DISABLE);
}

static void test_time_for_the_whole_travel(void)
{
    struct config config = {0};
    config.axis[2].homing_speed_towards_counts_s = 10000000;
    config.axis[2].homing_speed_away_counts_s = 1000000;
    config.travel[2].min_counts = -50000000;
    config.travel[2].max_counts = 50000000;
    TEST_ASSERT_EQUAL_UINT32(10u + 100u + HOMING_SPARE_S, homing_time_s(&config, 2));
    config.travel[2].min_counts = INT32_MIN;
    config.travel[2].max_counts = INT32_MAX;
    TEST_ASSERT_EQUAL_UINT32(HOMING_MAX_S, homing_time_s(&config, 2));
}

/* A drive that was homed reports so until it receives the command to home again; frames of that command are lost. */
static void test_an_old_success_is_not_taken_for_a_new_one(void)
{
    want(1, 37, 1000);
    boot();
    home();
    (void)app_bench_until(&bench, MACHINE_OFF, 500);
    bench.drives[0].position_counts = 7000;
    home();
    for (unsigned k = 0; bench.controller.homing.phase != HOMING_MOVE; ++k) {
        TEST_ASSERT_TRUE(k < 100u);
        app_bench_period(&bench);
    }
    bench.drives[0].deaf = 4;
    (void)app_bench_until(&bench, MACHINE_OFF, 500);
    TEST_ASSERT_EQUAL_INT32(1000, bench.drives[0].position_counts);
}

static void raise_a_fault(void *context)
{
    (void)context;
    port_lock();
    machine_raise(machine(), EMCY_SOFTWARE, 0, 0);
    port_unlock();
}

/* The tick raises a fault between two critical sections of the main loop: the goals of the fault stay. */
static void test_a_fault_of_a_tick_is_not_undone(void)
{
    struct can_msg out;
    want(1, 17, 0);
    boot();
    home();
    for (unsigned k = 0; bench.controller.homing.phase != HOMING_ENABLE; ++k) {
        TEST_ASSERT_TRUE(k < 100u);
        app_bench_period(&bench);
    }
    fake_port_on_unlock(raise_a_fault, NULL);
    (void)homing_process(&bench.controller.homing, machine(), 0, &out);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_INT(CIA402_GOAL_QUICK_STOP, machine()->axes[0].goal);
}

/* A program that was checked under another configuration; its check would keep the main loop from stop commands. */
static void test_no_program_is_checked_meanwhile(void)
{
    static uint8_t image[APP_IMAGE_SIZE];
    app_image_make(image, 10, -5);
    want(1, 17, 10000000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 12, 249, 2));
    boot();
    home();
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2000, 12));
    expect_start_refusal(MACHINE_MOVING);
    TEST_ASSERT_FALSE(program_slot_is_checked(&bench.controller.slot, &bench.controller.config));
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT64(10000000, app_bench_read(&bench, 0x2000, 12));
    TEST_ASSERT_TRUE(program_slot_is_checked(&bench.controller.slot, &bench.controller.config));
    expect_start_refusal(MACHINE_DRIVES_OFF);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_axes_one_after_the_other_from_off_to_off);
    RUN_TEST(test_axes_in_their_sequence);
    RUN_TEST(test_the_sequence_has_a_limit_and_leaves_drives_alone);
    RUN_TEST(test_only_axes_with_a_method);
    RUN_TEST(test_refusals);
    RUN_TEST(test_nothing_else_while_homing);
    RUN_TEST(test_a_homing_error_is_a_fault);
    RUN_TEST(test_no_end_is_a_fault);
    RUN_TEST(test_a_mode_that_is_not_taken_is_a_fault);
    RUN_TEST(test_a_drive_that_stops_sending_is_a_fault);
    RUN_TEST(test_stop_and_quick_stop_break_it_off);
    RUN_TEST(test_time_for_the_whole_travel);
    RUN_TEST(test_an_old_success_is_not_taken_for_a_new_one);
    RUN_TEST(test_a_fault_of_a_tick_is_not_undone);
    RUN_TEST(test_no_program_is_checked_meanwhile);
    return UNITY_END();
}
