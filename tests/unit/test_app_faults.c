/* SPDX-License-Identifier: MIT */
/* The reaction of the controller to drives, bus or operator that interrupt the program. Numbers of ticks are those
 * of docs/reference/architecture.md. Run by `make unit`; no I/O. */
#include <string.h>

#include "app/commands.h"
#include "app/objects.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "unity.h"

#define X_COUNTS    10000000
#define Y_COUNTS    (-5000000)
#define STEP_COUNTS 15001u /* 15 mm/s at 1 ms, and rounding */

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
        TEST_ASSERT_TRUE_MESSAGE(bench.drives[i].worst_step_counts <= STEP_COUNTS,
                                 "a setpoint jumped");
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, bench.drives[i].cut_moving,
                                         "power was taken from a moving drive");
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, bench.drives[i].quick_stop_moved,
                                         "a target moved in a quick stop");
    }
}

static struct machine *machine(void)
{
    return &bench.controller.machine;
}

static struct fake_drive *drive(unsigned i)
{
    return &bench.drives[i];
}

static void command(unsigned number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, number));
}

static void refused(unsigned number, enum machine_refusal reason)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, number));
    TEST_ASSERT_EQUAL_INT(reason, app_bench_read(&bench, 0x2003, 4));
}

static void switch_on(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    command(COMMAND_ENABLE);
    (void)app_bench_until(&bench, MACHINE_READY, 100);
}

static void run_some(uint32_t periods)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    switch_on();
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    command(COMMAND_START);
    app_bench_periods(&bench, periods);
}

static void real_drives(unsigned answer_wait_ms)
{
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        drive(i)->values.identity_object.vendor_id = 0x123;
    }
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 8, answer_wait_ms, 2));
}

static void expect_fault(uint16_t code, uint8_t node)
{
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_HEX16(code, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT(node, app_bench_read(&bench, 0x2003, 2));
    TEST_ASSERT_EQUAL_HEX16(code, bench.emergency);
}

static void until_phase(enum machine_fault_phase phase, uint32_t most)
{
    for (uint32_t k = 0; machine()->fault_phase != phase; ++k) {
        TEST_ASSERT_TRUE_MESSAGE(k < most, "the phase is not reached");
        app_bench_period(&bench);
    }
}

/* The drives are switched off, but for the one that has a fault of its own: it stays in that. */
static void expect_off_but(uint8_t faulty)
{
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        TEST_ASSERT_EQUAL_INT(drive(i)->node == faulty ? CIA402_FAULT : CIA402_SWITCH_ON_DISABLED,
                              drive(i)->state.state);
    }
}

static void expect_off(void)
{
    expect_off_but(0);
}

static void recover(void)
{
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x1001, 0));
    TEST_ASSERT_EQUAL_HEX16(EMCY_NO_ERROR, bench.emergency);
    command(COMMAND_ENABLE);
    (void)app_bench_until(&bench, MACHINE_READY, 100);
}

/* --- Answers that do not come --- */

static void test_one_missed_answer_is_counted_by_axis_and_tolerated(void)
{
    run_some(100);
    drive(1)->drops = 1;
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2008, 6));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2024, 1));
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2024, 2));
    for (unsigned i = 0; i < 20; ++i) {
        drive(i % 2u)->drops = 1;
        app_bench_periods(&bench, 2);
    }
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(21, app_bench_read(&bench, 0x2008, 6));
}

/* SYNCs j and j + 1 unanswered: the tick of SYNC j + 2 knows, and its setpoints brake the other one. */
static void test_more_than_that_is_a_fault_two_ticks_later(void)
{
    run_some(100);
    drive(0)->mute = true;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_period(&bench);
    expect_fault(EMCY_RPDO_TIMEOUT, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP, machine()->axes[1].controlword);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(1)->state.state);
    until_phase(MACHINE_FAULT_OFF, 10);
    expect_off();
}

static void test_missed_max_is_configured(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 9, 3, 1));
    run_some(100);
    drive(0)->drops = 3;
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    drive(0)->drops = 4;
    app_bench_periods(&bench, 5);
    expect_fault(EMCY_RPDO_TIMEOUT, 2);
}

static void test_real_drives_are_lost_by_the_clock(void)
{
    real_drives(0);
    run_some(100);
    TEST_ASSERT_EQUAL_UINT32(0, fake_port_awaited_us());
    drive(0)->drops = 2;
    app_bench_periods(&bench, 3);
    expect_fault(EMCY_RPDO_TIMEOUT, 2);
}

/* Patience is for simulated drives; real ones get 5 ms of it at most. */
static void test_patience_with_real_drives_is_bounded(void)
{
    real_drives(100);
    run_some(100);
    drive(0)->mute = true;
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_period(&bench);
    expect_fault(EMCY_RPDO_TIMEOUT, 2);
}

/* Late by one SYNC for a while: nothing is missed, since the last answers come two at a time. */
static void test_late_answers_are_neither_counted_nor_a_fault(void)
{
    real_drives(5);
    run_some(100);
    drive(1)->late = true;
    app_bench_periods(&bench, 3);
    drive(1)->late = false;
    app_bench_periods(&bench, 20);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2008, 6));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2024, 2));
}

/* However long the ticks of a slow host are apart: what was answered before the next SYNC is not missed. */
static void test_a_slow_host_is_no_fault(void)
{
    run_some(100);
    for (unsigned i = 0; i < 50; ++i) {
        fake_port_advance_us(3000000);
        app_bench_period(&bench);
    }
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2008, 6));
}

static void test_off_has_more_patience(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    drive(1)->mute = true;
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

/* --- Drives that do not follow --- */

/* A heartbeat that stops while the drive follows: the stop is on the path, then all are off. */
static void test_a_fault_with_all_drives_following_stops_on_the_path(void)
{
    run_some(250);
    port_lock();
    machine_raise(machine(), EMCY_HEARTBEAT, 3, 0);
    port_unlock();
    app_bench_period(&bench);
    expect_fault(EMCY_HEARTBEAT, 3);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    refused(COMMAND_RESET, MACHINE_MOVING);
    TEST_ASSERT_EQUAL_HEX16(CIA402_ENABLE_OPERATION, machine()->axes[0].controlword);
    until_phase(MACHINE_FAULT_OFF, 1000);
    app_bench_periods(&bench, 2);
    expect_off();
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, drive(1)->position_counts);
    TEST_ASSERT_TRUE(drive(0)->position_counts > X_COUNTS + 2000000);
    recover();
}

static void test_a_drive_lost_while_braking_makes_it_a_quick_stop(void)
{
    run_some(250);
    port_lock();
    machine_raise(machine(), EMCY_HEARTBEAT, 3, 0);
    port_unlock();
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    drive(0)->dead = true;
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    expect_fault(EMCY_HEARTBEAT, 3);
    until_phase(MACHINE_FAULT_OFF, 10);
}

/* It receives, it brakes, only its answers are lost: power is not taken from it while it moves. */
static void test_a_silent_drive_may_finish_its_quick_stop(void)
{
    run_some(250);
    drive(0)->quick_stop_syncs = 50;
    drive(0)->mute = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 10);
    until_phase(MACHINE_FAULT_OFF, 10);
    app_bench_periods(&bench, 20);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(0)->state.state);
    app_bench_periods(&bench, 40);
    expect_off();
    drive(0)->mute = false;
    recover();
}

static void test_a_drive_in_fault_makes_a_quick_stop_of_the_others(void)
{
    run_some(250);
    (void)cia402_device_fault(&drive(1)->state);
    app_bench_periods(&bench, 2);
    expect_fault(EMCY_GENERIC, 3);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(0)->state.state);
    refused(COMMAND_RESET, MACHINE_MOVING);
    until_phase(MACHINE_FAULT_OFF, 10);
    expect_off_but(3);
    recover();
}

static void test_a_drive_that_stops_quickly_by_itself(void)
{
    run_some(250);
    (void)cia402_device_quick_stop(&drive(0)->state);
    app_bench_periods(&bench, 2);
    expect_fault(FAULT_DROPPED_OUT, 2);
    until_phase(MACHINE_FAULT_OFF, 10);
    recover();
}

static void test_a_drive_that_restarts_is_not_braked_along_the_path(void)
{
    run_some(250);
    struct can_msg boot_up;
    cob_frame(&boot_up, COB_HEARTBEAT + 2u, 1);
    boot_up.data[0] = NMT_INITIALISING;
    fake_port_receive(&boot_up);
    app_bench_settle(&bench);
    expect_fault(FAULT_REBOOTED, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
}

static void lose_bits(uint16_t bits, uint16_t code, enum machine_fault_phase phase)
{
    run_some(250);
    drive(1)->state.flags &= (uint16_t)~bits;
    app_bench_periods(&bench, STATUSWORD_MONITOR_TOLERATED + 1u);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_period(&bench);
    expect_fault(code, 3);
    TEST_ASSERT_EQUAL_INT(phase, machine()->fault_phase);
    until_phase(MACHINE_FAULT_OFF, 1000);
    drive(1)->state.flags |= bits;
    recover();
}

static void test_voltage_lost(void)
{
    lose_bits(CIA402_STATUS_VOLTAGE, EMCY_DC_UNDERVOLTAGE, MACHINE_FAULT_QUICK);
}

static void test_remote_lost(void)
{
    lose_bits(CIA402_STATUS_REMOTE, FAULT_NOT_REMOTE, MACHINE_FAULT_QUICK);
}

static void test_enabled_but_not_following(void)
{
    lose_bits(CIA402_STATUS_FOLLOWS, FAULT_NOT_FOLLOWING, MACHINE_FAULT_QUICK);
}

static void test_following_error(void)
{
    run_some(250);
    drive(0)->state.flags |= CIA402_STATUS_FOLLOWING_ERROR;
    app_bench_periods(&bench, STATUSWORD_MONITOR_TOLERATED + 2u);
    expect_fault(EMCY_FOLLOWING_ERROR, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
}

static void test_internal_limit_is_a_warning(void)
{
    run_some(250);
    drive(0)->state.flags |= CIA402_STATUS_LIMIT | CIA402_STATUS_WARNING;
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
}

static void test_a_drive_that_never_follows_is_not_ready(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    drive(0)->state.flags &= (uint16_t)~CIA402_STATUS_FOLLOWS;
    command(COMMAND_ENABLE);
    app_bench_periods(&bench, MACHINE_ENABLE_TICKS - 10u);
    TEST_ASSERT_EQUAL_INT(MACHINE_ENABLING, machine()->state);
    app_bench_periods(&bench, 20);
    expect_fault(FAULT_NOT_ENABLED, 2);
}

static void emergency_of(uint8_t node, uint16_t code)
{
    struct can_msg emcy;
    cob_frame(&emcy, COB_EMCY + (uint32_t)node, 8);
    cob_put(emcy.data, code, 2);
    fake_port_receive(&emcy);
    app_bench_settle(&bench);
}

static void test_an_error_that_was_cleared_is_not_the_cause_of_a_later_fault(void)
{
    switch_on();
    emergency_of(3, EMCY_PDO_LENGTH);
    emergency_of(3, EMCY_NO_ERROR);
    (void)cia402_device_fault(&drive(1)->state);
    app_bench_periods(&bench, 2);
    expect_fault(EMCY_GENERIC, 3);
}

static void test_the_drives_own_code_replaces_a_vague_one_only(void)
{
    run_some(100);
    (void)cia402_device_quick_stop(&drive(0)->state);
    app_bench_periods(&bench, 2);
    expect_fault(FAULT_DROPPED_OUT, 2);
    emergency_of(3, 0x7300);
    expect_fault(FAULT_DROPPED_OUT, 2);
    emergency_of(2, EMCY_SYNC_LOST);
    expect_fault(EMCY_SYNC_LOST, 2);
    emergency_of(2, 0x7300);
    expect_fault(EMCY_SYNC_LOST, 2);
    TEST_ASSERT_EQUAL_HEX16(0x7300, app_bench_read(&bench, 0x200C, 1));
    TEST_ASSERT_EQUAL_INT(2, app_bench_read(&bench, 0x1003, 0));
    TEST_ASSERT_EQUAL_HEX16(EMCY_SYNC_LOST, app_bench_read(&bench, 0x1003, 1) & 0xFFFF);
    TEST_ASSERT_EQUAL_HEX16(FAULT_DROPPED_OUT, app_bench_read(&bench, 0x1003, 2) & 0xFFFF);
}

/* 0xFFxx of a drive is the manufacturer's own: as a fault of the controller the same number means something else. */
static void test_a_manufacturers_code_replaces_none(void)
{
    run_some(100);
    (void)cia402_device_quick_stop(&drive(0)->state);
    app_bench_periods(&bench, 2);
    emergency_of(2, FAULT_NOT_SENT);
    expect_fault(FAULT_DROPPED_OUT, 2);
    TEST_ASSERT_EQUAL_HEX16(FAULT_NOT_SENT, app_bench_read(&bench, 0x200C, 1));
}

/* Both the controller and a drive report 0x8250: the detail counts missed TPDO1s, so a drive's statusword is none. */
static void test_a_drive_that_misses_its_setpoints_reports_no_count(void)
{
    run_some(100);
    (void)cia402_device_quick_stop(&drive(0)->state);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_NOT_EQUAL(0, app_bench_read(&bench, 0x2003, 3));
    emergency_of(2, EMCY_RPDO_TIMEOUT);
    expect_fault(EMCY_RPDO_TIMEOUT, 2);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 3));
}

/* --- Bumpless --- */

/* Power off, the axis is moved by hand, power on. */
static void test_enabling_begins_where_the_axis_is(void)
{
    switch_on();
    command(COMMAND_DISABLE);
    app_bench_periods(&bench, 3);
    for (unsigned i = 0; i < 100; ++i) {
        drive(0)->position_counts += 5000;
        app_bench_period(&bench);
    }
    command(COMMAND_ENABLE);
    drive(0)->position_counts += 5000;
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 101 * 5000, drive(0)->position_counts);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 101 * 5000, drive(0)->target_counts);
}

static void test_after_a_lost_drive_enabling_begins_where_it_is_then(void)
{
    run_some(250);
    drive(0)->dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 10);
    until_phase(MACHINE_FAULT_OFF, 10);
    const int32_t elsewhere_counts = X_COUNTS - 7000000;
    fake_drive_init(drive(0), 2, elsewhere_counts);
    recover();
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT32(elsewhere_counts, drive(0)->position_counts);
    TEST_ASSERT_EQUAL_INT32(elsewhere_counts, drive(0)->target_counts);
}

/* --- Command 9 --- */

static void test_quick_stop_while_running(void)
{
    run_some(250);
    command(COMMAND_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(10, app_bench_read(&bench, 0x2002, 0));
    app_bench_periods(&bench, 2);
    for (unsigned i = 0; i < BENCH_DRIVES; ++i) {
        TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(i)->state.state);
    }
    refused(COMMAND_START, MACHINE_MOVING);
    refused(COMMAND_ENABLE, MACHINE_MOVING);
    command(COMMAND_STOP);
    command(COMMAND_QUICK_STOP);
    (void)app_bench_until(&bench, MACHINE_OFF, 10);
    expect_off();
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
    command(COMMAND_ENABLE);
    (void)app_bench_until(&bench, MACHINE_READY, 100);
}

static void test_quick_stop_without_end_is_a_fault(void)
{
    run_some(250);
    drive(1)->quick_stop_syncs = 5000;
    command(COMMAND_QUICK_STOP);
    for (unsigned i = 0; i < MACHINE_QUICK_TICKS - 10u; ++i) {
        drive(1)->position_counts += (int32_t)bench.controller.config.start_tolerance_counts;
        app_bench_periods(&bench, 1);
    }
    TEST_ASSERT_EQUAL_INT(MACHINE_QUICK_STOP, machine()->state);
    app_bench_periods(&bench, 20);
    expect_fault(FAULT_NOT_STOPPED, 3);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_OFF, machine()->fault_phase);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, drive(0)->state.state);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(1)->state.state);
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP, machine()->axes[1].controlword);
    drive(1)->position_counts += 2 * (int32_t)bench.controller.config.start_tolerance_counts;
    app_bench_periods(&bench, 2);
    refused(COMMAND_RESET, MACHINE_MOVING);
    app_bench_periods(&bench, AXIS_UNMOVED_SYNCS);
    recover();
}

/* As a drive does that has no 0x605A, or one that is 5 ... 7. */
static void test_a_drive_that_stays_in_quick_stop_has_stopped_when_it_stands(void)
{
    run_some(250);
    drive(1)->state.options.quick_stop = 6;
    command(COMMAND_QUICK_STOP);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS - 10u);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, drive(1)->state.state);
    (void)app_bench_until(&bench, MACHINE_OFF, 20);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
    expect_off();
}

static void test_quick_stop_has_nothing_to_stop(void)
{
    command(COMMAND_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    command(COMMAND_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    command(COMMAND_ENABLE);
    command(COMMAND_QUICK_STOP);
    (void)app_bench_until(&bench, MACHINE_OFF, 10);
    switch_on();
    command(COMMAND_QUICK_STOP);
    (void)app_bench_until(&bench, MACHINE_OFF, 10);
    expect_off();
}

static void test_quick_stop_ends_the_braking_of_a_fault(void)
{
    run_some(250);
    port_lock();
    machine_raise(machine(), EMCY_HEARTBEAT, 3, 0);
    port_unlock();
    app_bench_period(&bench);
    command(COMMAND_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    until_phase(MACHINE_FAULT_OFF, 10);
    command(COMMAND_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_OFF, machine()->fault_phase);
}

static void test_a_drive_that_faults_in_a_quick_stop(void)
{
    run_some(250);
    drive(0)->quick_stop_syncs = 100;
    command(COMMAND_QUICK_STOP);
    app_bench_periods(&bench, 5);
    (void)cia402_device_fault(&drive(0)->state);
    app_bench_periods(&bench, 2);
    expect_fault(EMCY_GENERIC, 2);
    until_phase(MACHINE_FAULT_OFF, 200);
    expect_off_but(2);
}

/* --- Homing --- */

static void home(void)
{
    port_lock();
    TEST_ASSERT_EQUAL_INT(MACHINE_ACCEPTED, machine_begin_homing(machine()));
    machine()->axes[0].goal = CIA402_GOAL_ENABLED;
    machine()->axes[0].control_extra = 0x10;
    port_unlock();
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, drive(0)->state.state);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, drive(1)->state.state);
    TEST_ASSERT_EQUAL_HEX16(CIA402_ENABLE_OPERATION | 0x10, machine()->axes[0].controlword);
}

static void test_homing_is_from_off_to_off(void)
{
    port_lock();
    TEST_ASSERT_EQUAL_INT(MACHINE_DRIVES_MISSING, machine_begin_homing(machine()));
    port_unlock();
    switch_on();
    port_lock();
    TEST_ASSERT_EQUAL_INT(MACHINE_DRIVES_ON, machine_begin_homing(machine()));
    port_unlock();
    command(COMMAND_DISABLE);
    app_bench_periods(&bench, 5);
    home();
    refused(COMMAND_ENABLE, MACHINE_MOVING);
    drive(0)->latched_counts = drive(0)->target_counts = 77;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT32(drive(0)->position_counts, machine()->axes[0].target_counts);
    app_bench_periods(&bench, 2);
    port_lock();
    machine_end_homing(machine());
    port_unlock();
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    app_bench_periods(&bench, 5);
    expect_off();
}

/* The drives are left in another mode: they are configured anew. */
static void test_homing_stopped_leads_to_boot(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    home();
    drive(0)->values.modes_of_operation = 6;
    command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_QUICK_STOP, machine()->state);
    (void)app_bench_until(&bench, MACHINE_BOOT, 10);
    expect_off();
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT(8, drive(0)->values.modes_of_operation);
}

static void test_a_fault_ends_homing(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    home();
    (void)cia402_device_quick_stop(&drive(0)->state);
    app_bench_periods(&bench, 2);
    expect_fault(FAULT_DROPPED_OUT, 2);
    port_lock();
    machine_end_homing(machine());
    port_unlock();
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    until_phase(MACHINE_FAULT_OFF, 10);
    recover();
}

/* --- Own frames --- */

static void test_frames_that_do_not_leave_are_a_fault(void)
{
    run_some(250);
    fake_port_fail_send(true);
    app_bench_periods(&bench, MACHINE_UNSENT_MAX);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    TEST_ASSERT_EQUAL_HEX16(FAULT_NOT_SENT, machine()->fault.code);
    TEST_ASSERT_EQUAL_INT(NMT_PRE_OPERATIONAL, bench.controller.nmt.state);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, machine()->statistics.missed_tpdos,
                                     "a SYNC that was not sent needs no answer");
    app_bench_periods(&bench, 50);
    fake_port_fail_send(false);
    app_bench_period(&bench);
    expect_fault(FAULT_NOT_SENT, 0);
    until_phase(MACHINE_FAULT_OFF, MACHINE_QUICK_TICKS);
    recover();
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.controller.nmt.state);
}

static void test_a_frame_now_and_then_is_counted_only(void)
{
    run_some(10);
    for (unsigned i = 0; i < 10; ++i) {
        fake_port_fail_send(true);
        app_bench_periods(&bench, 1);
        fake_port_fail_send(false);
        app_bench_periods(&bench, 1);
    }
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_INT(30, app_bench_read(&bench, 0x2008, 7));
}

/* Periods in which some frames are refused: no drive may get, from SYNC to SYNC, a step that the program does not
 * have. */
static void refuse_some(uint16_t id, uint16_t mask, uint32_t times)
{
    const struct can_match frames = {id, mask};
    run_some(250);
    int32_t before = drive(0)->position_counts;
    const uint32_t tick = machine()->statistics.program_tick;
    fake_port_refuse(&frames, times);
    for (unsigned i = 0; i < 10; ++i) {
        app_bench_period(&bench);
        const int32_t now = drive(0)->position_counts;
        TEST_ASSERT_TRUE(now >= before && (uint32_t)(now - before) <= STEP_COUNTS);
        before = now;
    }
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_UINT32(times, machine()->statistics.frames_not_sent);
    TEST_ASSERT_EQUAL_UINT32(10u - times, machine()->statistics.program_tick - tick);
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 4000000, drive(0)->position_counts);
}

static void test_program_time_waits_for_a_setpoint_that_does_not_leave(void)
{
    refuse_some(COB_RPDO1 + 2, CAN_ID_MAX, MACHINE_UNSENT_MAX);
}

static void test_program_time_waits_for_a_setpoint_of_another_axis(void)
{
    refuse_some(COB_RPDO1 + 3, CAN_ID_MAX, MACHINE_UNSENT_MAX);
}

static void test_program_time_waits_for_a_sync_that_does_not_leave(void)
{
    refuse_some(COB_SYNC, CAN_ID_MAX, MACHINE_UNSENT_MAX);
}

/* Twice answer_wait_ms, which is 100, at 1 ms. */
#define WAITING_TICKS 200u

/* Frames of a tick wait for the bus: a SYNC would go before the setpoints among them. */
static void test_program_time_waits_for_frames_that_wait_for_the_bus(void)
{
    run_some(250);
    const uint32_t tick = machine()->statistics.program_tick;
    const uint32_t syncs = machine()->statistics.syncs;
    const int32_t target = drive(0)->target_counts;
    fake_port_hold_frames(true);
    app_bench_periods(&bench, WAITING_TICKS);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, fake_port_awaited_us(), "all have answered");
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    TEST_ASSERT_EQUAL_UINT32(tick, machine()->statistics.program_tick);
    TEST_ASSERT_EQUAL_UINT32(syncs, machine()->statistics.syncs);
    TEST_ASSERT_EQUAL_INT32(target, drive(0)->target_counts);
    TEST_ASSERT_EQUAL_UINT32(WAITING_TICKS, machine()->statistics.frames_not_sent);
    fake_port_hold_frames(false);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(tick + 1u, machine()->statistics.program_tick);
    TEST_ASSERT_EQUAL_UINT32(syncs + 1u, machine()->statistics.syncs);
    TEST_ASSERT_EQUAL_UINT32(0, machine()->statistics.missed_tpdos);
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + 4000000, drive(0)->position_counts);
}

static void test_frames_that_wait_for_too_long_are_a_fault(void)
{
    run_some(250);
    fake_port_hold_frames(true);
    app_bench_periods(&bench, WAITING_TICKS + MACHINE_UNSENT_MAX);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_HEX16(FAULT_NOT_SENT, machine()->fault.code);
    const uint32_t syncs = machine()->statistics.syncs;
    app_bench_periods(&bench, 50);
    TEST_ASSERT_EQUAL_UINT32(syncs, machine()->statistics.syncs);
    fake_port_hold_frames(false);
    app_bench_period(&bench);
    expect_fault(FAULT_NOT_SENT, 0);
    until_phase(MACHINE_FAULT_OFF, MACHINE_QUICK_TICKS);
    recover();
}

static void test_real_drives_wait_for_one_tick_only(void)
{
    real_drives(5);
    run_some(250);
    fake_port_hold_frames(true);
    app_bench_period(&bench);
    fake_port_hold_frames(false);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    fake_port_hold_frames(true);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    const int32_t target = drive(0)->target_counts;
    fake_port_hold_frames(false);
    app_bench_period(&bench);
    expect_fault(FAULT_SYNC_GAP, 0);
    TEST_ASSERT_EQUAL_INT32(target, drive(0)->target_counts);
    until_phase(MACHINE_FAULT_OFF, 100);
    recover();
}

/* --- Position and setpoint --- */

static void test_a_drive_that_does_not_follow_without_a_word(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201D, 1, 30000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201E, 1, 10, 2));
    run_some(250);
    drive(0)->deaf = 1000; /* 15000 counts a tick: out of the window with the third */
    app_bench_periods(&bench, 3u + 10u + CONFIG_DEVIATION_SYNCS);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_periods(&bench, 4);
    expect_fault(FAULT_POSITION_DEVIATION, 2);
    TEST_ASSERT_TRUE(app_bench_read(&bench, 0x2003, 3) > 30000);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    drive(0)->deaf = 0;
    drive(0)->following = false; /* what it receives then is no step of the path */
    until_phase(MACHINE_FAULT_OFF, 1000);
    recover();
}

/* Without a window no deviation is reported during the motion: but the program has not been completed. */
static void test_ready_means_at_the_target(void)
{
    run_some(450);
    drive(1)->position_counts += 12000; /* more than the tolerance of 10000 */
    drive(1)->latched_counts += 12000;
    drive(1)->target_counts += 12000;
    drive(1)->deaf = 10000;
    (void)app_bench_until(&bench, MACHINE_FAULT, 60 + MACHINE_SETTLE_TICKS + MACHINE_ARRIVE_TICKS);
    expect_fault(FAULT_POSITION_DEVIATION, 3);
    TEST_ASSERT_EQUAL_INT(12000, app_bench_read(&bench, 0x2003, 3));
}

static void test_an_axis_that_arrives_late_is_waited_for(void)
{
    run_some(450);
    drive(1)->position_counts += 12000;
    drive(1)->latched_counts += 12000;
    drive(1)->target_counts += 12000;
    drive(1)->deaf = 1000;
    const uint32_t took = app_bench_until(&bench, MACHINE_READY, 1100);
    TEST_ASSERT_TRUE(took > 950u);
}

/* --- Time --- */

static void test_a_gap_of_syncs_with_real_drives_is_a_fault(void)
{
    real_drives(5);
    run_some(250);
    fake_port_advance_us(1000);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    const int32_t target = drive(0)->target_counts;
    fake_port_advance_us(1200);
    app_bench_period(&bench);
    expect_fault(FAULT_SYNC_GAP, 0);
    TEST_ASSERT_EQUAL_INT(2200, app_bench_read(&bench, 0x2003, 3));
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_QUICK, machine()->fault_phase);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(target, drive(0)->target_counts, "no setpoint after the gap");
    until_phase(MACHINE_FAULT_OFF, 100);
    recover();
}

static void test_real_drives_need_a_port_that_keeps_time(void)
{
    real_drives(5);
    fake_port_set_timing(PORT_TIMING_REFUSED);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_TRUE(fake_port_urgent());
    TEST_ASSERT_EQUAL_INT(PORT_TIMING_REFUSED, app_bench_read(&bench, 0x2040, 0));
    refused(COMMAND_ENABLE, MACHINE_NOT_IN_TIME);
    refused(COMMAND_HOME, MACHINE_NOT_IN_TIME);
    fake_port_set_timing(PORT_TIMING_ACCEPTED);
    switch_on();
}

static void test_simulated_drives_need_none(void)
{
    fake_port_set_timing(PORT_TIMING_REFUSED);
    switch_on();
    TEST_ASSERT_FALSE(fake_port_urgent());
}

static void fails_now(void *context)
{
    (void)context;
    machine_raise(machine(), EMCY_GENERIC, 2, 0);
}

/* A fault between the test whether the configuration may change and the change: it does not. */
static void test_a_fault_in_the_middle_of_a_write(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    const int64_t before = app_bench_read(&bench, 0x2005, 1);
    const uint8_t value = 9;
    const struct od_entry *entry = od_find(&bench.controller.od, 0x2005, 1);
    fake_port_on_unlock(fails_now, NULL);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE,
                            objects_hooks.write(&bench.controller, entry, &value, 1));
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, machine()->state);
    TEST_ASSERT_EQUAL_INT(before, app_bench_read(&bench, 0x2005, 1));
    TEST_ASSERT_EQUAL_UINT8(before, bench.controller.config.node[0]);
    TEST_ASSERT_EQUAL_UINT8(before, machine()->config.node[0]);
}

/* --- Reset --- */

/* A statusword with Fault, for ever, and no EMCY with it: the mapping may be another one. */
static void test_a_reset_configures_a_drive_that_speaks_nonsense(void)
{
    run_some(100);
    drive(1)->stuck = true;
    app_bench_periods(&bench, 2);
    until_phase(MACHINE_FAULT_OFF, 10);
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_BOOT, MACHINE_RESET_TICKS + 5u);
    drive(1)->stuck = false;
    (void)cia402_device_control(&drive(1)->state, 0);
    (void)cia402_device_control(&drive(1)->state, CIA402_FAULT_RESET);
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
}

static void test_reset_when_off_configures_anew(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    const uint32_t starts = bench.starts;
    command(COMMAND_RESET);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, machine()->state);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_UINT32(starts + BENCH_DRIVES, bench.starts);
}

static void test_a_reset_while_the_cause_persists_gives_the_fault_again(void)
{
    run_some(100);
    drive(1)->stuck = true;
    app_bench_periods(&bench, 2);
    emergency_of(3, 0x7305);
    until_phase(MACHINE_FAULT_OFF, 10);
    expect_fault(0x7305, 3);
    bench.emergency = 0;
    command(COMMAND_RESET);
    until_phase(MACHINE_FAULT_RESETTING, 2);
    until_phase(MACHINE_FAULT_OFF, MACHINE_RESET_TICKS + 2u);
    expect_fault(0x7305, 3);
    refused(COMMAND_ENABLE, MACHINE_FAULT_PRESENT);
    drive(1)->stuck = false;
    emergency_of(3, EMCY_NO_ERROR);
    recover();
}

static void test_a_reset_without_the_drive_leaves_it_to_boot(void)
{
    run_some(100);
    drive(1)->dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 10);
    until_phase(MACHINE_FAULT_OFF, 10);
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_BOOT, 10);
    app_bench_periods(&bench, 1200);
    TEST_ASSERT_EQUAL_INT(3, app_bench_read(&bench, 0x2025, 1));
    drive(1)->dead = false;
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
}

/* An axis configured in FAULT has no drive yet: it is no reason to stay there. */
static void test_a_reset_with_one_more_axis_leads_to_boot(void)
{
    run_some(100);
    drive(1)->dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 10);
    until_phase(MACHINE_FAULT_OFF, 10);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2005, 3, 9, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 1, 3, 1));
    TEST_ASSERT_EQUAL_UINT8(9, machine()->axes[2].node);
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_BOOT, 10);
}

/* The same fault of another drive is reported again. */
static void test_each_fault_is_reported(void)
{
    switch_on();
    (void)cia402_device_fault(&drive(0)->state);
    (void)cia402_device_stopped(&drive(0)->state);
    app_bench_periods(&bench, 10);
    expect_fault(EMCY_GENERIC, 2);
    recover();
    (void)cia402_device_fault(&drive(1)->state);
    (void)cia402_device_stopped(&drive(1)->state);
    app_bench_periods(&bench, 10);
    expect_fault(EMCY_GENERIC, 3);
    TEST_ASSERT_EQUAL_INT(2, app_bench_read(&bench, 0x1003, 0));
}

/* A host that has just reset the communication learns what is wrong without asking. */
static void test_a_fault_that_stays_is_reported_after_a_reset_of_the_communication(void)
{
    struct can_msg reset;
    nmt_master_command(NMT_RESET_COMMUNICATION, 1, &reset);
    run_some(100);
    (void)cia402_device_fault(&drive(0)->state);
    (void)cia402_device_stopped(&drive(0)->state);
    app_bench_periods(&bench, 2);
    until_phase(MACHINE_FAULT_OFF, 10);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x1003, 0));
    bench.emergency = 0;
    fake_port_receive(&reset);
    app_bench_periods(&bench, 2);
    expect_fault(EMCY_GENERIC, 2);
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x1003, 0));
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.controller.nmt.state);
    recover();
}

/* --- Heartbeats --- */

static void test_a_node_has_one_entry_in_1016(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 4, 0x00090190u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 4, 0x00090200u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_INCOMPATIBLE,
                            app_bench_write(&bench, 0x1016, 5, 0x00090190u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 5, 0x00090000u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 5, 0x00000190u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 4, 0u, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 5, 0x00090190u, 4));
}

static void test_heartbeat_time_is_object_1016(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 4, 0x00030190u, 4));
    run_some(10);
    command(COMMAND_HOLD);
    (void)app_bench_until(&bench, MACHINE_HELD, 500);
    app_bench_periods(&bench, 300);
    drive(1)->silent_heart = true;
    const uint32_t periods = app_bench_until(&bench, MACHINE_FAULT, 3000);
    TEST_ASSERT_TRUE(periods > 290u && periods <= 410u);
    expect_fault(EMCY_HEARTBEAT, 3);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
}

/* --- The host, where 0x1016 names it --- */

#define HOST_NODE 127u

static void host_says(enum nmt_state state)
{
    struct can_msg frame;
    cob_frame(&frame, COB_HEARTBEAT + HOST_NODE, 1);
    frame.data[0] = (uint8_t)state;
    fake_port_receive(&frame);
    app_bench_settle(&bench);
}

static void watch_host(uint32_t time_ms)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                            app_bench_write(&bench, 0x1016, 1, HOST_NODE << 16 | time_ms, 4));
}

static void test_a_host_that_stops_sending_stops_the_axes_on_the_path(void)
{
    watch_host(100);
    run_some(50);
    host_says(NMT_OPERATIONAL);
    app_bench_periods(&bench, 90);
    host_says(NMT_OPERATIONAL);
    const uint32_t periods = app_bench_until(&bench, MACHINE_FAULT, 200);
    TEST_ASSERT_TRUE(periods >= 100u && periods <= 121u);
    app_bench_settle(&bench);
    expect_fault(EMCY_HEARTBEAT, HOST_NODE);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    until_phase(MACHINE_FAULT_OFF, 1000);
    app_bench_periods(&bench, 2);
    expect_off();
    TEST_ASSERT_EQUAL_UINT32(0, drive(0)->cut_moving);
    recover();
}

static void test_a_host_that_restarts_is_lost_too(void)
{
    watch_host(1000);
    run_some(100);
    host_says(NMT_OPERATIONAL);
    host_says(NMT_INITIALISING);
    app_bench_period(&bench);
    expect_fault(EMCY_HEARTBEAT, HOST_NODE);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
}

static void test_a_host_is_watched_from_its_first_heartbeat_on(void)
{
    watch_host(50);
    run_some(100);
    host_says(NMT_INITIALISING);
    app_bench_periods(&bench, 200);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
}

static void test_without_an_entry_no_host_is_watched(void)
{
    run_some(50);
    host_says(NMT_OPERATIONAL);
    app_bench_periods(&bench, 300);
    host_says(NMT_INITIALISING);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
}

static void test_with_drives_off_the_host_may_go(void)
{
    watch_host(50);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    host_says(NMT_OPERATIONAL);
    app_bench_periods(&bench, 300);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

/* --- The main loop --- */

static void test_a_main_loop_that_stands_still_stops_the_axes_on_the_path(void)
{
    run_some(100);
    TEST_ASSERT_EQUAL_UINT32(0, machine()->main_loop_stall_us);
    fake_port_advance_us(1000);
    fake_port_tick(0);
    TEST_ASSERT_EQUAL_UINT32(1000, machine()->main_loop_stall_us);
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_UINT32(0, machine()->main_loop_stall_us);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    machine()->main_loop_stall_us = MACHINE_MAIN_LOOP_STALL_US + 1u;
    app_bench_period(&bench);
    expect_fault(FAULT_MAIN_LOOP_STALL, 0);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_BRAKING, machine()->fault_phase);
    until_phase(MACHINE_FAULT_OFF, 1000);
    TEST_ASSERT_EQUAL_UINT32(0, drive(0)->cut_moving);
    app_bench_periods(&bench, 2);
    recover();
}

static void test_at_standstill_the_main_loop_may_take_its_time(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    switch_on();
    machine()->main_loop_stall_us = MACHINE_MAIN_LOOP_STALL_US + 1u;
    app_bench_period(&bench);
    TEST_ASSERT_EQUAL_INT(MACHINE_READY, machine()->state);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_host_that_stops_sending_stops_the_axes_on_the_path);
    RUN_TEST(test_a_host_that_restarts_is_lost_too);
    RUN_TEST(test_a_host_is_watched_from_its_first_heartbeat_on);
    RUN_TEST(test_without_an_entry_no_host_is_watched);
    RUN_TEST(test_with_drives_off_the_host_may_go);
    RUN_TEST(test_a_main_loop_that_stands_still_stops_the_axes_on_the_path);
    RUN_TEST(test_at_standstill_the_main_loop_may_take_its_time);
    RUN_TEST(test_one_missed_answer_is_counted_by_axis_and_tolerated);
    RUN_TEST(test_more_than_that_is_a_fault_two_ticks_later);
    RUN_TEST(test_missed_max_is_configured);
    RUN_TEST(test_real_drives_are_lost_by_the_clock);
    RUN_TEST(test_patience_with_real_drives_is_bounded);
    RUN_TEST(test_late_answers_are_neither_counted_nor_a_fault);
    RUN_TEST(test_a_slow_host_is_no_fault);
    RUN_TEST(test_off_has_more_patience);
    RUN_TEST(test_a_fault_with_all_drives_following_stops_on_the_path);
    RUN_TEST(test_a_drive_lost_while_braking_makes_it_a_quick_stop);
    RUN_TEST(test_a_silent_drive_may_finish_its_quick_stop);
    RUN_TEST(test_a_drive_in_fault_makes_a_quick_stop_of_the_others);
    RUN_TEST(test_a_drive_that_stops_quickly_by_itself);
    RUN_TEST(test_a_drive_that_restarts_is_not_braked_along_the_path);
    RUN_TEST(test_voltage_lost);
    RUN_TEST(test_remote_lost);
    RUN_TEST(test_enabled_but_not_following);
    RUN_TEST(test_following_error);
    RUN_TEST(test_internal_limit_is_a_warning);
    RUN_TEST(test_a_drive_that_never_follows_is_not_ready);
    RUN_TEST(test_the_drives_own_code_replaces_a_vague_one_only);
    RUN_TEST(test_a_manufacturers_code_replaces_none);
    RUN_TEST(test_a_drive_that_misses_its_setpoints_reports_no_count);
    RUN_TEST(test_enabling_begins_where_the_axis_is);
    RUN_TEST(test_after_a_lost_drive_enabling_begins_where_it_is_then);
    RUN_TEST(test_quick_stop_while_running);
    RUN_TEST(test_quick_stop_without_end_is_a_fault);
    RUN_TEST(test_a_drive_that_stays_in_quick_stop_has_stopped_when_it_stands);
    RUN_TEST(test_quick_stop_has_nothing_to_stop);
    RUN_TEST(test_quick_stop_ends_the_braking_of_a_fault);
    RUN_TEST(test_a_drive_that_faults_in_a_quick_stop);
    RUN_TEST(test_homing_is_from_off_to_off);
    RUN_TEST(test_homing_stopped_leads_to_boot);
    RUN_TEST(test_a_fault_ends_homing);
    RUN_TEST(test_frames_that_do_not_leave_are_a_fault);
    RUN_TEST(test_a_frame_now_and_then_is_counted_only);
    RUN_TEST(test_a_reset_while_the_cause_persists_gives_the_fault_again);
    RUN_TEST(test_a_reset_without_the_drive_leaves_it_to_boot);
    RUN_TEST(test_a_reset_with_one_more_axis_leads_to_boot);
    RUN_TEST(test_each_fault_is_reported);
    RUN_TEST(test_a_fault_that_stays_is_reported_after_a_reset_of_the_communication);
    RUN_TEST(test_a_node_has_one_entry_in_1016);
    RUN_TEST(test_heartbeat_time_is_object_1016);
    RUN_TEST(test_an_error_that_was_cleared_is_not_the_cause_of_a_later_fault);
    RUN_TEST(test_program_time_waits_for_a_setpoint_that_does_not_leave);
    RUN_TEST(test_program_time_waits_for_a_setpoint_of_another_axis);
    RUN_TEST(test_program_time_waits_for_a_sync_that_does_not_leave);
    RUN_TEST(test_program_time_waits_for_frames_that_wait_for_the_bus);
    RUN_TEST(test_frames_that_wait_for_too_long_are_a_fault);
    RUN_TEST(test_real_drives_wait_for_one_tick_only);
    RUN_TEST(test_a_drive_that_does_not_follow_without_a_word);
    RUN_TEST(test_ready_means_at_the_target);
    RUN_TEST(test_an_axis_that_arrives_late_is_waited_for);
    RUN_TEST(test_a_gap_of_syncs_with_real_drives_is_a_fault);
    RUN_TEST(test_real_drives_need_a_port_that_keeps_time);
    RUN_TEST(test_simulated_drives_need_none);
    RUN_TEST(test_a_reset_configures_a_drive_that_speaks_nonsense);
    RUN_TEST(test_reset_when_off_configures_anew);
    RUN_TEST(test_a_fault_in_the_middle_of_a_write);
    return UNITY_END();
}
